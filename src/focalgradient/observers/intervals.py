"""Encoding of the two intervals of a threshold trial: pictures with and without the level.

Pictures are encoded at a few levels, and responses are interpolated on log level; the parameters of an observer enter
afterwards. One encoding thus serves all observers of a study.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtr

from focalgradient.arrays import FloatArray
from focalgradient.dataset import check_stimuli
from focalgradient.design import BlurThresholdDesign
from focalgradient.observers.encoding import PUPIL, EncodedStimulus, encode_light
from focalgradient.observers.observer import Observer
from focalgradient.observers.perception import relief
from focalgradient.observers.pictures import cache_folder, kept_stimuli
from focalgradient.observers.questions import more_blurred
from focalgradient.parallel import in_order
from focalgradient.progress import Progress
from focalgradient.render.rendered import LUMINANCE
from focalgradient.stimuli import StimulusSet, blurred_scene, read_set

__all__ = ["JUDGEMENTS", "SeenLevels", "encoded_levels", "seen_intervals"]


ENCODED = 11
"""Number of encoded levels."""

ENCODING = 2
"""Version of the encoding; cached data of other versions are ignored."""

FIXATIONS = 40
"""Number of simulated fixations per level from which the depth response is computed."""


@dataclass(frozen=True, slots=True, eq=False)
class SeenLevels:
    """Encoded scene at several levels.

    Parameters
    ----------
    picture
        File of the sharp picture in its set.
    levels
        Level added, in the unit of the design.
    without, added
        Encoded stimuli of both intervals at each level.
    sampling
        Sampling blur of the display's pixels in arcmin, which is subtracted.
    judged
        Judgement of the design: see `JUDGEMENTS`.
    """

    picture: str
    levels: FloatArray
    without: Sequence[EncodedStimulus]
    added: Sequence[EncodedStimulus]
    sampling: float
    judged: str

    def more(self, observer: Observer) -> FloatArray:
        """Return the probability at each of `levels` that the interval with the level is judged to have more."""
        pairs = zip(self.added, self.without, strict=True)
        return np.array([JUDGEMENTS[self.judged](added, without, observer, self.sampling) for added, without in pairs])

    def right_shares(self, observer: Observer) -> FloatArray:
        """Return the probability of a correct answer at each of `levels`, including lapses."""
        lapses = 1.0 if observer.guesses else observer.lapses
        return lapses / 2 + (1 - lapses) * self.more(observer)


def _more_blurred(one: EncodedStimulus, other: EncodedStimulus, observer: Observer, sampling: float) -> float:
    """Return the probability by the ratio of blurs including intrinsic blur (`BlurDiscrimination`)."""

    def whole(stimulus: EncodedStimulus) -> tuple[float, float]:
        """Return the blur of a whole picture in arcmin, and the SD of its logarithm."""
        weight = np.broadcast_to(np.asarray(stimulus.blur_log_sd, float), stimulus.blur.shape) ** -2.0
        log = float(weight @ np.log(stimulus.blur) / weight.sum())
        return math.sqrt(max(math.exp(2 * log) - sampling**2, 0.0)), float(weight.sum() ** -0.5)

    return more_blurred(whole(one), whole(other), observer)


def _deeper(one: EncodedStimulus, other: EncodedStimulus, observer: Observer, _: float) -> float:
    """Return the probability by the ratio of perceived depths with the scatter of ratings."""
    logs = [
        np.log([relief(stimulus, observer, np.random.default_rng(seed)) for seed in range(FIXATIONS)])
        for stimulus in (one, other)
    ]
    sd = math.sqrt(logs[0].var() + logs[1].var() + 2 * observer.scatter**2)
    return float(ndtr((logs[0].mean() - logs[1].mean()) / max(sd, 1e-9)))


JUDGEMENTS: Mapping[str, Callable[[EncodedStimulus, EncodedStimulus, Observer, float], float]] = {
    "blur": _more_blurred,
    "depth": _deeper,
}
"""Probability that the first interval is judged to have more, by the judgement of the design."""


def encoded_levels(
    design: BlurThresholdDesign,
    stimuli: StimulusSet,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> dict[str, SeenLevels]:
    """Encode both intervals of each scene of a design at `ENCODED` levels, cached in the user's cache folder.

    Parameters
    ----------
    design
        Design with scenes, pedestal, pupil and levels.
    stimuli
        Set with the sharp pictures.
    executor
        Executor that encodes several at once and can read the set's folder. None: this process.
    progress
        Function called with the completed fraction, 0 to 1, and a description of the work.

    Raises
    ------
    InputError
        If the set lacks a scene, or the cache cannot be written.
    """
    files = {scene: stimuli.picture(scene, "pinhole", design.fixation).png for scene in design.scenes}
    levels = np.geomspace(design.levels[0], design.levels[-1], ENCODED)

    sampling = 0.5 * stimuli.display.arcmin(1.0)
    named = repr((design.judged, design.fixation, design.pedestal, design.pupil_mm, levels.tolist(), ENCODING))
    seen_levels = {}
    for number, scene in enumerate(design.scenes):
        made_of = f"{check_stimuli(stimuli.folder).sha256} {scene} {named}"
        place = cache_folder() / f"levels-{hashlib.sha256(made_of.encode()).hexdigest()[:16]}.npz"
        jobs = [(stimuli.folder, design, scene, float(level)) for level in levels]

        def pairs(jobs: Sequence[Any] = jobs, number: int = number) -> list[EncodedStimulus]:
            found: list[EncodedStimulus] = []
            for done, pair in enumerate(in_order(executor, _pair, jobs), start=1):
                found += pair
                if progress is not None:
                    progress((number + done / len(jobs)) / len(design.scenes), "encoding levels")
            return found

        stored = kept_stimuli(place, 2 * ENCODED, pairs)
        seen_levels[scene] = SeenLevels(files[scene], levels, stored[::2], stored[1::2], sampling, design.judged)
    return seen_levels


def _pair(job: tuple[Path, BlurThresholdDesign, str, float]) -> list[EncodedStimulus]:
    """Encode a scene without and with a level; the texture slope is estimated from both."""
    folder, design, scene, level = job
    stimuli = read_set(folder)
    fixation = stimuli.scene(scene).target(design.fixation).position_px
    both = [
        stimuli.display.decode(blurred_scene(stimuli, design, scene, amount)) @ np.array(LUMINANCE)
        for amount in (design.pedestal, design.pedestal + level)
    ]
    distance = stimuli.depth(scene)
    return [
        encode_light(picture, stimuli.display, [fixation], distance, PUPIL, beside=[other])[0]
        for picture, other in (both, both[::-1])
    ]


def seen_intervals(
    design: BlurThresholdDesign, folder: Path | None, executor: Executor | None, progress: Progress
) -> dict[str, Any]:
    """Return the stimuli of threshold observers: arguments `encoded` and `stimuli` of `simulate`.

    Parameters
    ----------
    design
        Design of the experiment.
    folder
        Folder of the pictures; None: no pictures, and a known threshold.
    executor
        Executor that encodes the pictures; None: this process.
    progress
        Function called with the completed fraction and a description of the work.
    """
    if folder is None:
        return {}
    stimuli = read_set(folder)
    return {"encoded": encoded_levels(design, stimuli, executor, progress), "stimuli": stimuli.folder}
