"""What observers see of the two intervals of a threshold: pictures with and without the level, encoded side by side.

Pictures are encoded at a few levels, between which answers go evenly with the level's logarithm; an observer's own
numbers come in afterwards. So one encoding serves all observers of a study.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from focalgradient.dataset import check_stimuli
from focalgradient.design import BlurThresholdDesign
from focalgradient.observers.encoding import PUPIL, EncodedStimulus, encode_light
from focalgradient.observers.observer import Observer
from focalgradient.observers.perception import relief
from focalgradient.observers.pictures import ARRAYS, cache_folder, keep_arrays, kept_arrays
from focalgradient.observers.questions import more_blurred
from focalgradient.progress import Progress
from focalgradient.render.rendered import LUMINANCE
from focalgradient.stimuli import StimulusSet, blurred_scene, read_set

__all__ = ["JUDGEMENTS", "SeenBlur", "SeenDepth", "SeenLevels", "encoded_levels", "seen_intervals"]

FloatArray = NDArray[np.float64]

ENCODED = 11
"""Levels at which pictures are encoded."""

ENCODING = 1
"""Version of how they are: what another version has kept is not used."""

FIXATIONS = 40
"""Fixations by which depth is judged at a level."""


@dataclass(frozen=True, slots=True, eq=False)
class SeenLevels:
    """A scene as it is seen at some levels.

    Parameters
    ----------
    picture
        File of the sharp picture in its set.
    levels
        What is added, in the unit of the design.
    without, added
        The encoded stimuli of both intervals at each level.
    sampling
        Blur of the display's pixels in arcmin, which is taken off.
    """

    picture: str
    levels: FloatArray
    without: Sequence[EncodedStimulus]
    added: Sequence[EncodedStimulus]
    sampling: float

    def more(self, observer: Observer) -> FloatArray:
        """Probability at each of `levels` that the interval with the level is taken for the one with more."""
        raise NotImplementedError

    def right_shares(self, observer: Observer) -> FloatArray:
        """Probability of a right answer at each of `levels`, with what is answered without looking."""
        lapses = 1.0 if observer.guesses else observer.lapses
        return lapses / 2 + (1 - lapses) * self.more(observer)


class SeenBlur(SeenLevels):
    """Which is more blurred: by the ratio of both blurs, the intrinsic one included, as `BlurDiscrimination`."""

    __slots__ = ()

    def more(self, observer: Observer) -> FloatArray:
        """See `SeenLevels`."""
        pairs = zip(self.added, self.without, strict=True)
        return np.array([more_blurred(self._whole(one), self._whole(other), observer) for one, other in pairs])

    def _whole(self, stimulus: EncodedStimulus) -> tuple[float, float]:
        """Blur of a whole picture in arcmin, and the sd of its logarithm."""
        weight = np.broadcast_to(np.asarray(stimulus.blur_log_sd, float), stimulus.blur.shape) ** -2.0
        log = float(weight @ np.log(stimulus.blur) / weight.sum())
        return math.sqrt(max(math.exp(2 * log) - self.sampling**2, 0.0)), float(weight.sum() ** -0.5)


class SeenDepth(SeenLevels):
    """Which looks deeper: by the ratio of both pictures' depth, each with the scatter of a judgement."""

    __slots__ = ()

    def more(self, observer: Observer) -> FloatArray:
        """See `SeenLevels`."""
        found = []
        for one, other in zip(self.added, self.without, strict=True):
            logs = [
                np.log([relief(each, observer, np.random.default_rng(seed)) for seed in range(FIXATIONS)])
                for each in (one, other)
            ]
            sd = math.sqrt(logs[0].var() + logs[1].var() + 2 * observer.scatter**2)
            found.append(float(ndtr((logs[0].mean() - logs[1].mean()) / max(sd, 1e-9))))
        return np.array(found)


JUDGEMENTS: Mapping[str, type[SeenLevels]] = {"blur": SeenBlur, "depth": SeenDepth}
"""By what a design has people judge."""


def encoded_levels(
    design: BlurThresholdDesign,
    stimuli: StimulusSet,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> dict[str, SeenLevels]:
    """Encode both intervals of each scene of a design at `ENCODED` of its levels; kept in the user's cache folder.

    Parameters
    ----------
    design
        Whose scenes, pedestal, pupil and levels.
    stimuli
        The set with the sharp pictures.
    executor
        What encodes several at once; it must be able to read the set's folder. None: this process.
    progress
        Called with the share done, 0 to 1, and what is being done.

    Raises
    ------
    InputError
        If the set lacks a scene, or what is encoded cannot be kept.
    """
    files = {scene: stimuli.picture(scene, "pinhole", design.fixation).png for scene in design.scenes}
    levels = np.geomspace(design.levels[0], design.levels[-1], ENCODED)
    kind = JUDGEMENTS[design.judged]
    sampling = 0.5 * stimuli.display.arcmin(1.0)
    named = repr((design.judged, design.fixation, design.pedestal, design.pupil_mm, levels.tolist(), ENCODING))
    found = {}
    for number, scene in enumerate(design.scenes):
        made_of = f"{check_stimuli(stimuli.folder).sha256} {scene} {named}"
        place = cache_folder() / f"levels-{hashlib.sha256(made_of.encode()).hexdigest()[:16]}.npz"
        arrays = kept_arrays(place, (ENCODED, 2))
        if arrays is None:
            jobs = [(stimuli.folder, design, scene, float(level)) for level in levels]
            pairs = []
            for done, pair in enumerate(map(_pair, jobs) if executor is None else executor.map(_pair, jobs), start=1):
                pairs.append(pair)
                if progress is not None:
                    progress((number + done / len(jobs)) / len(design.scenes), "encoding levels")
            arrays = {name: np.array([[getattr(one, name) for one in pair] for pair in pairs]) for name in ARRAYS}
            keep_arrays(arrays, place)
        without, added = (
            [
                EncodedStimulus(blur[at], float(fixated[at]), depth[at], log_sd[at])
                for blur, fixated, depth, log_sd in zip(*(arrays[name] for name in ARRAYS), strict=True)
            ]
            for at in (0, 1)
        )
        found[scene] = kind(files[scene], levels, without, added, sampling)
    return found


def _pair(job: tuple[Path, BlurThresholdDesign, str, float]) -> list[EncodedStimulus]:
    """Encode a scene without and with a level; the slope of their texture is estimated from both."""
    folder, design, scene, level = job
    stimuli = read_set(folder)
    fixation = stimuli.scene(scene).target(design.fixation).position_px
    both = [
        stimuli.display.decode(blurred_scene(stimuli, design, scene, amount)) @ np.array(LUMINANCE)
        for amount in (design.pedestal, design.pedestal + level)
    ]
    distance = stimuli.depth(scene)
    return [
        encode_light(one, stimuli.display, [fixation], distance, PUPIL, beside=[other])[0]
        for one, other in (both, both[::-1])
    ]


def seen_intervals(
    design: BlurThresholdDesign, folder: Path | None, executor: Executor | None, progress: Progress
) -> dict[str, Any]:
    """Return what observers of a threshold look at: arguments `encoded` and `stimuli` of `simulate`.

    Parameters
    ----------
    design
        That they take part in.
    folder
        Of the pictures; None: they look at none, and have a known threshold.
    executor
        What encodes them; None: this process.
    progress
        Takes the share that is done, and what is done.
    """
    if folder is None:
        return {}
    stimuli = read_set(folder)
    return {"encoded": encoded_levels(design, stimuli, executor, progress), "stimuli": stimuli.folder}
