"""Tone played by the operating system's audio player, without a sound library."""

from __future__ import annotations

import atexit
import shutil
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
from scipy.io import wavfile

__all__ = ["PLAYERS", "player", "tone"]

PLAYERS = (("paplay",), ("pw-play",), ("aplay", "-q"), ("afplay",))
"""Programs that play a WAV file on Linux and macOS."""

PLAYING: list[subprocess.Popen[bytes]] = []
"""Processes of tones that have not ended."""

RATE, HERTZ, SECONDS = 44100, 880.0, 0.3
RAMP = 0.01
"""Duration of the onset and offset ramps in s, which prevent clicks."""


def player() -> tuple[str, ...] | None:
    """Return the command that plays a WAV file on this computer (Windows: Python's winsound); None without one."""
    if sys.platform == "win32":
        return ("winsound",)
    return next((words for words in PLAYERS if shutil.which(words[0])), None)


def tone() -> bool:
    """Start playing a tone, and return immediately; return whether a player was found.

    >>> tone() in (True, False)
    True
    """
    words = player()
    if words is None:
        return False
    if sys.platform == "win32":
        import winsound

        winsound.PlaySound(str(_file()), winsound.SND_FILENAME | winsound.SND_ASYNC)
        return True
    try:
        found = subprocess.Popen([*words, str(_file())], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    except OSError:
        return False
    PLAYING[:] = [one for one in PLAYING if one.poll() is None] + [found]
    return True


@cache
def _file() -> Path:
    """Write the tone to a WAV file, which exists until this program ends; return its path."""
    folder = tempfile.mkdtemp(prefix="focalgradient-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    path = Path(folder, "tone.wav")
    time = np.arange(round(RATE * SECONDS)) / RATE
    loud = np.clip(np.minimum(time, SECONDS - time) / RAMP, 0.0, 1.0)
    wavfile.write(path, RATE, np.rint(16000 * loud * np.sin(2 * np.pi * HERTZ * time)).astype("<i2"))
    return path
