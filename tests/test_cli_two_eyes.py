"""``focalgradient stereo`` and ``focalgradient focus-series``: what they write and what they refuse."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import Result
from command_line import run

WIDTH, HEIGHT = 60, 40


@pytest.fixture
def given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A card at 0.8 m before a wall at 1.6 m, in colour."""
    monkeypatch.chdir(tmp_path)
    light = np.random.default_rng(1).integers(40, 220, (HEIGHT, WIDTH, 3)).astype(np.uint8)
    cv2.imwrite("picture.png", cv2.GaussianBlur(light, (0, 0), 1.0))
    metres = np.full((HEIGHT, WIDTH), 1.6)
    metres[10:30, 20:40] = 0.8
    np.save("depth.npy", metres)
    return tmp_path


def stereo(*words: str) -> Result:
    return run("stereo", "picture.png", "depth.npy", "--out", "out", "--pupil", "4", "--field", "6", *words)


def test_two_views_and_their_truth_are_written(given: Path) -> None:
    ways = ["anaglyph", "colour-anaglyph", "side-by-side", "crossed", "over-under", "rows", "halves", "screens"]
    shown = [word for way in ways for word in ("--show", way)]
    found = stereo("--focus", "0.8", "--interocular", "10", "--screen", "200x60", "--json", *shown)
    assert found.exit_code == 0, found.output
    summary = json.loads(found.stdout)
    assert len(summary["written"]) == len(list((given / "out").iterdir())) == 14
    sizes = {"side-by-side": (40, 120), "over-under": (80, 60), "rows": (40, 60), "halves": (60, 200)}
    for name, size in sizes.items():
        read = cv2.imread(f"out/{name}.png")
        assert read is not None
        assert read.shape[:2] == size
    angle = np.radians(summary["pixel_arcmin"] / 60)
    with np.load("out/left.npz") as left:
        assert left["light"].shape == (HEIGHT, WIDTH, 3)
        assert np.unique(left["disparity"].round(6)).tolist() == pytest.approx([-0.01 * 0.625, 0])  # the card: screen
        assert np.unique(left["blur"].round(6)).tolist() == pytest.approx([0, 0.002 * 0.625])
        assert left["is_invented"].any()
    assert summary["disparity_px"][0] == pytest.approx(-0.01 * 0.625 / angle, rel=1e-3)


def test_a_focus_series_states_filled_holes_and_the_limit_of_its_planes(
    given: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("focalgradient.live.series.MAX_INTERVALS", 4)
    metres = np.load("depth.npy")
    metres[0, 0] = np.nan
    np.save("depth.npy", metres)
    lens = ["--f-number", "4", "--focal-length", "16", "--field", "2", "--error", "0.5"]
    found = run("focus-series", "picture.png", "depth.npy", "--out", "out", *lens, "--json")
    assert found.exit_code == 0, found.output
    summary = json.loads(found.stdout)
    assert summary["planes"] <= 5
    assert ["no depth" in warning for warning in summary["warnings"]] == [True, False]
    assert "more than 5 planes: set --error to" in found.stderr
    assert "FocalGradientWarning" not in found.stderr
