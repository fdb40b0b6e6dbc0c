"""`focalgradient stimuli` from the command line: what it makes, what it says, and what it says when it cannot."""

import json
from functools import partial
from pathlib import Path

import command_line
import numpy as np
import pytest
from click import Command

from focalgradient.cli.blur import blur
from focalgradient.cli.stimuli import stimuli
from focalgradient.srgb import srgb_to_linear
from focalgradient.stimuli import read_set

CAST = ["--engine", "cast", "--samples", "4", "--size", "128", "--scenes", "1", "--seed", "2"]


run = partial(command_line.run, "stimuli")
succeed = partial(command_line.succeed, "stimuli")


def test_depth_rating(tmp_path: Path) -> None:
    display = ["--screen", "1280x1024", "--screen-width", "38.4", "--distance", "0.6", "--gamma", "2.2", "--dither"]
    result = succeed("depth-rating", "--out", tmp_path, *CAST, *display)
    assert "Pictures: 7" in result.stdout
    assert "% at most (limit 0.5)\n" in result.stdout
    assert "8-bit steps at most (limit 0.5): NOT met" in result.stdout  # of 4 rays
    made = read_set(tmp_path)
    shown = made.display
    assert (shown.size_px, shown.gamma, shown.dither, shown.distance) == ((1280, 1024), 2.2, True, 0.6)
    assert shown.pixel_pitch == pytest.approx(0.3e-3)
    succeed("depth-rating", "--out", tmp_path, *CAST, *display)
    other = run("depth-rating", "--out", tmp_path, *CAST)
    assert other.exit_code == 2
    assert "contains another set" in other.stderr


def test_necker(tmp_path: Path) -> None:
    shown = ["--gradient", "nonrigid", "--edge", 3, "--speed", 0.5]
    shown += ["--frame-rate", 24, "--size", 300, "--line-width", 4]
    result = succeed("necker", "--out", tmp_path, *shown, "--aperture", 30, "--direction", "left")
    assert "turning left, 2" in result.stdout  # per cent, for the other reading
    made = json.loads((tmp_path / "manifest.json").read_text())
    assert list(made["conditions"]) == ["nonrigid"]
    assert (tmp_path / "nonrigid.mp4").stat().st_size > 1000
    assert len(list((tmp_path / "nonrigid").glob("*.png"))) == 12


@pytest.mark.parametrize("command", [["depth-rating", "--seed", "1"], ["necker"]])
def test_a_file_in_the_folders_place_is_told_before_the_work(tmp_path: Path, command: list[str]) -> None:
    (tmp_path / "file").write_text("mine")
    result = run(*command, "--out", tmp_path / "file")
    assert result.exit_code == 2
    assert "cannot be written" in result.stderr
    assert (tmp_path / "file").read_text() == "mine"


def depth_options(command: Command) -> dict[str | None, object]:
    shared = ("depth_unit", "depth_scale", "baseline", "disparity_offset", "encoding")
    return {one.name: one.to_info_dict() for one in command.params if one.name in shared}


def test_a_photographs_depth_is_read_as_blur_reads_it(tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    picture, metres = random.uniform(0.1, 0.9, (64, 96)).astype(np.float32), np.full((64, 96), 2.0)
    metres[20:44, 30:66] = 1.0
    angle = 2 * np.tan(np.radians(10) / 2) / 96
    np.save(tmp_path / "scene.npy", picture)
    np.save(tmp_path / "metres.npy", metres)
    np.save(tmp_path / "disparity.npy", 0.1 / (angle * metres) - 7)
    shown = ["--picture", tmp_path / "scene.npy", "--field", 10, "--apertures", "8", "--screen-width", 200]
    disparity = ["--depth-unit", "disparity", "--baseline", 0.1, "--disparity-offset", 7]
    for name, given in (("metres", []), ("disparity", disparity)):
        succeed("depth-rating", "--out", tmp_path / name, "--depth", tmp_path / f"{name}.npy", *shown, *given)
    one, other = (read_set(tmp_path / name) for name in ("metres", "disparity"))
    assert np.allclose(one.depth("scene"), other.depth("scene"), rtol=1e-6)
    decoded = ["--depth", tmp_path / "metres.npy", *shown, "--encoding", "srgb"]
    succeed("depth-rating", "--out", tmp_path / "decoded", *decoded)
    sharp = read_set(tmp_path / "decoded")
    light = sharp.linear(sharp.picture("scene", "pinhole", "nearest"))[..., 0]
    assert np.allclose(light, srgb_to_linear(picture), atol=1e-5)
    wrong = ["--depth", tmp_path / "metres.npy", *shown, "--disparity-offset", 7]
    ended = run("depth-rating", "--out", tmp_path / "wrong", *wrong)
    assert (ended.exit_code, ended.stderr.count("\n")) == (2, 1)
    assert "--disparity-offset are for disparity" in ended.stderr
    (tmp_path / "in" / "scene").mkdir(parents=True)
    (tmp_path / "metres.npy").rename(inside := tmp_path / "in" / "scene" / "depth.npy")
    before = inside.read_bytes()
    ended = run("depth-rating", "--out", tmp_path / "in", "--depth", inside, *shown)
    assert (ended.exit_code, "is in --out" in ended.stderr) == (2, True)
    assert inside.read_bytes() == before
    assert len(depth_options(blur)) == 5
    assert depth_options(stimuli.commands["depth-rating"]) == depth_options(blur)
