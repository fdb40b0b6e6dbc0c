"""`focalgradient stimuli NAME`: drawn stimuli from the command line, with options made of the functions' parameters."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import command_line
import numpy as np
import pytest
from PIL import Image

from focalgradient import stimuli
from focalgradient.display import Display
from focalgradient.stimuli.drawn_files import FILES

SMALL = {
    "texture-border": ["--width-deg", 3, "--height-deg", 2, "--equalise", "luminance,contrast"],
    "blurred-edge": ["--width-deg", 2, "--height-deg", 2, "--increment-arcmin", 0.5],
    "dead-leaves": ["--width-deg", 3, "--height-deg", 2, "--blurs-arcmin", "0,2.5"],
    "wide-field": ["--window-deg", 6, "--eccentricity-deg", 0.5],
    "slanted-plane": ["--width-deg", 3, "--height-deg", 2, "--slant-deg", 50],
    "corrugated-plane": ["--width-deg", 3, "--height-deg", 2, "--focus-m", 0.5],
    "miniature": ["--width-deg", 4, "--height-deg", 3, "--gradient", "vertical"],
    "fixated-cube": ["--edge-deg", 4, "--width-deg", 8, "--height-deg", 8],
}


succeed = partial(command_line.succeed, "stimuli")


@pytest.mark.parametrize("name", SMALL)
def test_the_files_are_what_the_function_draws(tmp_path: Path, name: str) -> None:
    result = succeed(name, "--out", tmp_path / "made", "--screen-width", 40, "--json", *SMALL[name])
    assert {file.name for file in (tmp_path / "made").iterdir()} == set(FILES)
    summary = json.loads((tmp_path / "made" / "stimulus.json").read_text(encoding="utf-8"))
    whole = {**summary, "written": str(tmp_path / "made")}
    assert whole | json.loads(result.stdout) == whole
    parameters = {key: tuple(one) if isinstance(one, list) else one for key, one in summary["parameters"].items()}
    display = Display.of_width(0.40)
    assert parameters["pixels_per_degree"] == pytest.approx(display.pixels_per_degree)
    one = getattr(stimuli, name.replace("-", "_"))(**parameters)
    arrays = {"picture": one.picture, "sharp": one.sharp, "depth": one.depth_m, "blur": one.blur_arcmin}
    for file, array in arrays.items():
        np.testing.assert_array_equal(np.load(tmp_path / "made" / f"{file}.npy"), array.astype(np.float32))
    np.testing.assert_array_equal(Image.open(tmp_path / "made" / "picture.png"), display.encode(one.picture))
    with np.load(tmp_path / "made" / "masks.npz") as masks:
        assert set(masks) == {mask.replace(" ", "_") for mask in one.masks}


def test_replicas(tmp_path: Path) -> None:
    succeed("replica", "mather2002", "--condition", "right sharp, blurred border", "--out", tmp_path / "made")
    summary = json.loads((tmp_path / "made" / "stimulus.json").read_text(encoding="utf-8"))
    assert summary["source"] == ["mather2002"]
    assert summary["controlled"]["near"] == "left"
    assert summary["controlled"]["stated_in_paper"] == ["border"]


def test_a_set_is_made_of_what_was_drawn(tmp_path: Path) -> None:
    """Pictures are those that were drawn, to the last of the 8 bits; a file that was changed since is refused."""
    size = ("--screen-width", 40, "--pupil-mm", 6, "--width-deg", 3, "--height-deg", 2)
    shape = ("--psf", "polygon", "--blades", 5)
    succeed("slanted-plane", "--out", tmp_path / "plane", *size)
    succeed("texture-border", "--out", tmp_path / "border", *shape, *size)
    folders = tmp_path / "plane", tmp_path / "border"
    result = succeed("set", *folders, "--out", tmp_path / "made", "--json")
    assert json.loads(result.stdout)["controls"]["sharpest"]["met"]
    made = stimuli.read_set(tmp_path / "made")
    assert made.scenes == ("plane", "border")
    assert made.display == Display.of_width(0.40)
    for name in made.scenes:
        drawn = np.asarray(Image.open(tmp_path / name / "picture.png"))
        np.testing.assert_array_equal(made.pixels(made.picture(name, "f/8.333", "focus"))[..., 0], drawn)
    assert made.manifest["parameters"]["stimuli"]["border"]["parameters"]["psf"]["blades"] == 5
    one, display = stimuli.read_stimulus(tmp_path / "border")
    again = stimuli.texture_border(**one.parameters)
    np.testing.assert_allclose(again.picture, one.picture, atol=1e-7)
    assert display == made.display
