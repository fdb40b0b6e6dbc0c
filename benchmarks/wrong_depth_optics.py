"""Rows of `wrong_depth`: exchanged optics, and views without valid pixels."""

from __future__ import annotations

import tempfile
import warnings
from dataclasses import replace

import numpy as np
from depth_slips import SETUPS, SLIPS, Given, photographs
from reruns import Lines, run_command

from focalgradient import Lens, View, cast, recover_depth
from focalgradient.scenes import slant

PITCH = 8e-6
FOCI = (0.8, 1.2, 1.9)


def _views(given: Given) -> list[View]:
    """Return the pictures as views, with the stated optics."""
    lenses = [Lens(given.focal / 1e3, n, f) for n, f in zip(given.f_numbers, given.foci, strict=True)]
    pairs = zip(given.pictures, lenses, strict=True)
    return [View(one.astype(np.float32), lens, given.pitch * 1e-6 / lens.sensor_distance) for one, lens in pairs]


def _said(views: list[View], near: float | None) -> tuple[float, str]:
    """Return the valid fraction, and the warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        depth = recover_depth(views, near=near)
    return float(depth.valid.mean()), " ".join(str(one.message) for one in caught)


def _three_foci(exchanged: bool, seed: int) -> tuple[float, str]:
    """Return the results for three foci of one magnification, in order or with the first two exchanged."""
    lenses = [Lens(0.025, 5.6, focus) for focus in FOCI]
    angle = PITCH / lenses[1].sensor_distance
    scene = slant(0.9, 2.2, field=256 * angle, seed=seed)
    random = np.random.default_rng(seed)
    images = [cast(scene, lens, (256, 256), angle, seed=seed).view.image for lens in lenses]
    images = [one / one.mean() + 0.01 * random.standard_normal(one.shape) for one in images]
    stated = [lenses[1], lenses[0], lenses[2]] if exchanged else lenses
    return _said([View(i.astype(np.float32), lens, angle) for i, lens in zip(images, stated, strict=True)], None)


def _command(*args: str) -> str:
    """Return exit code and last output line of a command."""
    code, printed, errors = run_command(*args)
    return f"exit {code}: {(errors + printed).strip().splitlines()[-1][:160]}"


def add_lines(table: Lines) -> None:
    """Add the rows 2.7 and 2.8."""

    @table.line("2.7.1", "two apertures in the wrong order", ".1 % valid, no warning")
    def swapped() -> str:
        valid, text = _said(_views(SLIPS["f-numbers in reverse order"](photographs("two apertures"))), 0.85)
        return f"{valid:.1%} valid, {'named' if 'apertures in reverse order' in text else 'not named'}"

    @table.line("2.7.2", "three foci, the first two exchanged, 3 seeds", "not always named")
    def exchanged() -> str:
        found = ["foci of views 1 and 2 exchanged" in _three_foci(True, seed)[1] for seed in range(3)]
        return f"named in {sum(found)} of {len(found)}"

    @table.line("2.7.3", "three foci in order, 3 seeds", "called reversed on some photographs")
    def in_order() -> str:
        found = ["contradict the optics" in _three_foci(False, seed)[1] for seed in range(3)]
        return f"a slip is named in {sum(found)} of {len(found)}"

    @table.line("2.7.4", "right optics, both setups", "no slip named")
    def right() -> str:
        texts = [_said(_views(photographs(setup)), 0.85)[1] for setup in SETUPS]
        return f"a slip is named in {sum('contradict' in text for text in texts)} of {len(texts)}"

    @table.line("2.8.1", "an eye's views that contradict each other", "exit 0: All is in focus. Median error: nan D")
    def eye() -> str:
        with tempfile.TemporaryDirectory() as folder:
            return _command("eye", "spheres", "--out", folder, "--pupil", "5", "--accommodation", "2")

    @table.line("2.8.2", "a view displaced by 8 pixels", "exit 0; noise is blamed")
    def displaced() -> str:
        given = photographs("two apertures")
        moved = replace(given, pictures=(given.pictures[0], np.roll(given.pictures[1], (5, 6), (0, 1))))
        valid, text = _said(_views(moved), 0.85)
        return f"{valid:.1%} valid, {'displacement named first' if 'displaced' in text[:120] else text[:80]}"

    @table.line("2.8.3", "views of two scenes", "exit 0, valid 0 %")
    def scenes() -> str:
        valid, text = _said(_views(SLIPS["another scene"](photographs("two apertures"))), 0.85)
        return f"{valid:.1%} valid: {text[:110]}"
