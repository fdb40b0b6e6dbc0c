"""A tone, by what the operating system has: no library of sound is needed for one."""

from __future__ import annotations

import atexit
import math
import shutil
import struct
import subprocess
import sys
import tempfile
import wave
from functools import cache
from pathlib import Path

__all__ = ["PLAYERS", "player", "tone"]

PLAYERS = (("paplay",), ("pw-play",), ("aplay", "-q"), ("afplay",))
"""Programs that play a WAV file, on Linux and macOS."""

PLAYING: list[subprocess.Popen[bytes]] = []
"""Tones that have not ended."""

RATE, HERTZ, SECONDS = 44100, 880.0, 0.3
RAMP = 0.01
"""Seconds in which the tone swells and fades, so that it does not click."""


def player() -> tuple[str, ...] | None:
    """The program that plays a tone here; None where there is none. On Windows it is Python's own winsound."""
    if sys.platform == "win32":
        return ("winsound",)
    return next((words for words in PLAYERS if shutil.which(words[0])), None)


def tone() -> bool:
    """Begin to play a tone, and come back at once: whether something plays it.

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
    """A WAV file with the tone, for as long as this program runs."""
    folder = tempfile.mkdtemp(prefix="focalgradient-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    path = Path(folder, "tone.wav")
    samples = []
    for number in range(round(RATE * SECONDS)):
        time = number / RATE
        loud = min(1.0, time / RAMP, (SECONDS - time) / RAMP)
        samples.append(round(16000 * loud * math.sin(2 * math.pi * HERTZ * time)))
    with wave.open(str(path), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(RATE)
        file.writeframes(struct.pack(f"<{len(samples)}h", *samples))
    return path
