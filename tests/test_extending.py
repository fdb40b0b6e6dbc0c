"""docs/own-optics.md: the examples of a shape of blur and of optics, built from nothing in a temporary package."""

from __future__ import annotations

import json
import re
import shlex
import sys
import tomllib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from command_line import run, sentence
from textures import natural_spectrum

from focalgradient import InputError, Lens, View, recover_depth
from focalgradient.depth import methods_for
from focalgradient.eye import band_light, blur_transfer, off_axis
from focalgradient.psf import check_psf, pixel_transfer, psf_of, registry
from focalgradient.retina import TwoEyes

PAGE = Path(__file__).parents[1] / "docs" / "own-optics.md"
TEXT = "\n".join(PAGE.with_name(name).read_text(encoding="utf-8") for name in ("extending.md", "own-optics.md"))
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", TEXT, re.DOTALL | re.MULTILINE)
PIXEL = 3.2e-4


def block(kind: str, mark: str) -> str:
    (found,) = [text for name, text in BLOCKS if name == kind and mark in text]
    return found


def test_what_the_page_names_exists() -> None:
    """Each file is there; each name is a word of the sources or examples, a private one of a file of the same step."""
    prose = re.sub(r"^```.*?^```$", "", TEXT, flags=re.DOTALL | re.MULTILINE)
    root = PAGE.parents[1]
    sources = {
        path.relative_to(root).as_posix(): {*re.findall(r"\w+", path.read_text(encoding="utf-8"))}
        for folder in ("src", "tests", "analysis", "experiments")
        for path in (root / folder).rglob("*.py")
    }
    words = {*re.findall(r"\w+", "".join(code for _, code in BLOCKS))}.union(*sources.values())
    for step in re.split(r"\n(?=\d\. |\n)", prose):
        paths = [path for path in re.findall(r"`([\w/]+\.py)`", step) if "NAME" not in path]
        files = {file for path in paths for file in sources if file.endswith(path)}
        assert len(files) >= len({*paths} - {"numeric_rating.py", "edge_blur.py", "soft_bokeh.py"}), paths
        names = {*re.findall(r"`(?:[a-z_]+\.)*([A-Za-z_]\w*)(?:\([^`]*\))?`", step)} - {"NAME"}
        private = {name for name in names if name.startswith("_")}
        assert names <= words, names - words
        assert private <= {*()}.union(*(sources[file] for file in files)), private


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The page's package, as an installer leaves it: its module, and the entry points of its pyproject.toml."""
    project = tomllib.loads(block("toml", 'entry-points."focalgradient.psf"'))["project"]
    place = tmp_path / "installed"
    notes = place / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
    notes.mkdir(parents=True)
    (place / "soft_bokeh.py").write_text(block("python", "class Apodised"), encoding="utf-8")
    (notes / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    groups = project["entry-points"].items()
    lines = [line for group, names in groups for line in (f"[{group}]", *(f"{n} = {at}" for n, at in names.items()))]
    (notes / "entry_points.txt").write_text("\n".join(lines) + "\n")
    monkeypatch.syspath_prepend(str(place))
    registry._added.cache_clear()
    yield place
    sys.modules.pop("soft_bokeh", None)
    registry._added.cache_clear()


def walls(psf, lenses, distance: float = 1.3, side: int = 160) -> list[View]:
    """A textured wall through `lenses`, beyond their focus, blurred by a shape."""
    random = np.random.default_rng(3)
    size = side + 96
    y, x = np.fft.fftfreq(size)[:, None], np.fft.rfftfreq(size)
    spectrum = natural_spectrum((size, size), random, 0.1) * pixel_transfer(y, x)
    found = []
    for lens in lenses:
        seen = np.fft.irfft2(spectrum * psf.optical_transfer(y, x, float(lens.blur_radius(distance)) / PIXEL))
        image = 0.5 + seen[48:-48, 48:-48] + 0.003 * random.standard_normal((side, side))
        found.append(View(image.astype(np.float32), lens, PIXEL))
    return found


LENSES = [Lens(0.025, number, 0.85) for number in (16, 5)]


def test_the_shape_of_the_page_works_at_once_with_all_methods_that_can_use_it(package: Path) -> None:
    from soft_bokeh import Apodised  # type: ignore[import-not-found]

    for power in (0.1, 8.0):
        check_psf(Apodised(power))
    own = Apodised(power=2.0)
    assert psf_of("apodised") == Apodised(1.0)
    assert methods_for(own) == ["equalise", "spectra", "ratio", "autofocus"]
    views = walls(own, LENSES, side=112)
    for method in ("equalise", "spectra", "ratio"):
        depth = recover_depth(views, psf=own, method=method, near=0.85)
        assert np.median(depth.distance[depth.valid]) == pytest.approx(1.3, rel=0.01)
        assert (depth.details["psf"], depth.details["psf_parameters"]) == ("apodised", {"power": 2.0})
    with pytest.raises(
        InputError, match=r"'edges' needs the edge response, which apodised does not give: use method '"
    ):
        recover_depth(views, psf=own, method="edges", near=0.85)


def test_the_commands_find_it_by_name(package: Path, tmp_path: Path) -> None:
    views = walls(psf_of("apodised"), LENSES, side=128)
    for number, view in enumerate(views):
        np.save(tmp_path / f"{number}.npy", view.image)
    cv2.imwrite(str(tmp_path / "picture.png"), np.random.default_rng(0).integers(0, 255, (48, 64), np.uint8))
    np.save(tmp_path / "distance.npy", np.full((48, 64), 1.2))
    shots = "".join(
        f'[[view]]\nimage = "{n}.npy"\nf_number = {f}\nfocus_distance_m = 0.85\n' for n, f in ((0, 16), (1, 5))
    )
    pitch = PIXEL * LENSES[0].sensor_distance * 1e6
    (tmp_path / "views.toml").write_text(f"[camera]\nfocal_length_mm = 25.0\npixel_pitch_um = {pitch}\n{shots}")
    lines = block("sh", "--psf apodised").replace("demo/", f"{tmp_path}/").strip().splitlines()
    for line, name in zip(lines, ("soft", "soft-depth"), strict=True):
        program, *words = shlex.split(line)
        assert program == "focalgradient"
        words[words.index("--out") + 1] = str(tmp_path / name)
        result = run(*words, *(["--near", 0.85] if words[0] == "depth" else []))
        assert result.exit_code == 0, result.output
    summary = json.loads((tmp_path / "soft-depth" / "summary.json").read_text())
    assert summary["settings"]["psf_parameters"] == {"power": 2.0}
    assert json.loads((tmp_path / "soft" / "summary.json").read_text())["settings"]["psf"] == "apodised"
    assert "--power X" in run("depth", "--help").stdout
    refused = run("depth", tmp_path / "views.toml", "--out", tmp_path / "no", "--psf", "apodised", "--power", 9)
    assert "--power is 9.0, but must be a number from 0.1 to 8" in sentence(refused)


@pytest.mark.slow
def test_the_optics_of_the_page_give_both_sides(capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(block("python", "class DualPixel"), str(PAGE), "exec", dont_inherit=True), {"__name__": "page"})
    said = capsys.readouterr().out
    assert said.splitlines() == ["0.9 estimated from the views", "1.3 estimated from the views"]


def test_the_eye_of_the_page_sees_depth_by_colour(capsys: pytest.CaptureFixture[str]) -> None:
    """The page's eye passes the check and its views give depth; two of it turn inwards, and what it lacks is named."""
    names: dict[str, Any] = {"__name__": "builtins"}  # a module that is there, as dataclasses ask for
    exec(compile(block("python", "class SlitEye"), str(PAGE), "exec", dont_inherit=True), names)
    assert capsys.readouterr().out == "0.7\n"
    eye = names["SlitEye"](1.0)
    assert TwoEyes(eye, eye).accommodated(0.5).left.focus_vergence == pytest.approx(1.5)
    with pytest.raises(InputError, match="mirrored"):
        TwoEyes.of(eye)
    with pytest.raises(InputError, match="aberrated"):
        off_axis(eye, 20.0)
    upright, level = (blur_transfer(*at, eye, 0.5, light=band_light("S")) for at in ((800, 0), (0, 800)))
    assert abs(upright) < 0.5 * level
