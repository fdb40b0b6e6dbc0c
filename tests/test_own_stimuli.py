"""docs/own-stimuli.md: every block of it is run, in order, on tiny pictures."""

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image
from scipy.ndimage import gaussian_filter

from focalgradient.cli import main
from focalgradient.dataset import read_dataset
from focalgradient.design import load_design
from focalgradient.lab import EXPERIMENTS
from focalgradient.observers.pictures import CACHE
from focalgradient.stimuli import read_set

PAGE = Path(__file__).parents[1] / "docs" / "own-stimuli.md"


@pytest.mark.slow
def test_every_block_of_the_page_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(CACHE, str(tmp_path / "cache"))
    photographs(Path("photos"))
    for kind, text in re.findall(r"```(\w+)\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL):
        if kind == "csv":
            Path("photos", "pictures.csv").write_text(text, encoding="utf-8")
        elif kind == "toml":
            marks = {"factors": "weathers", "fixations": "three", "f/2": "blurred"}
            name = next((name for mark, name in marks.items() if mark in text), "design")
            Path(f"{name}.toml").write_text(text, encoding="utf-8")
        else:
            assert kind == "sh"
            for line in text.strip().splitlines():
                program, *words = shlex.split(line)
                assert program == "focalgradient"
                ended = CliRunner().invoke(main, words, catch_exceptions=False)
                assert ended.exit_code == 0, ended.output
    weathers, factors = read_set("weathers"), load_design(Path("weathers.toml"))
    for trial in factors.trials("01"):
        if not trial.scene.startswith("example-"):
            shown = weathers.picture(trial.scene, trial.aperture, trial.fixation, trial.factors)
            assert shown.others["weather"] == trial.factors["weather"]
    pair = [weathers.picture("yard", "f/8", "nearest", {"weather": level}).png for level in ("sun", "rain")]
    assert pair == ["yard/f8-nearest.png", "yard/f8-nearest-2.png"]
    assert len(EXPERIMENTS["depth-rating"].pictures(factors)) > 0
    report = Path("three-report", "report.md").read_text(encoding="utf-8")
    assert all(f"“{name}” in focus" in report for name in ("gate", "tree", "house"))
    assert "“house” and “tree”" in report
    assert read_dataset("three-simulated").depth_rating["fixation"].nunique() == 3
    assert read_set("three").scene("yard").target("tree").position_px == (20, 20)
    controls = read_set("blurred").manifest["controls"]
    assert set(controls) == {"scenes", "mean_luminance_percent", "shift_px", "spectrum_percent", "sharpest"}
    assert controls["shift_px"]["met"]
    assert "f/2" in Path("blurred-report", "report.md").read_text(encoding="utf-8")
    own, design = read_set("own"), load_design(Path("design.toml"))
    for shown in EXPERIMENTS["depth-rating"].pictures(design):  # all that the laboratory's program looks for
        assert own.pixels(own.picture(*shown)).shape == (128, 128, 3)
    assert json.loads(Path("wide", "manifest.json").read_text())["parameters"]["apertures"] == [
        *("pinhole", "f/8", "f/4", "f/2")
    ]


def photographs(folder: Path) -> None:
    """Two scenes of random texture with a near square, sharp and blurred."""
    folder.mkdir()
    random = np.random.default_rng(1)
    for scene in ("yard", "street"):
        grey = gaussian_filter(random.standard_normal((128, 128)), 1.0)
        distance = np.full((128, 128), 2.0)
        distance[40:90, 30:80] = 0.8
        np.save(folder / f"{scene}.npy", distance)
        near = distance < 1
        for name, where in (("", near | True), ("-near", near), ("-far", ~near)):
            seen = np.where(where, grey, gaussian_filter(grey, 3.0))
            values = np.clip(128 + 100 * seen / grey.std() / 2, 0, 255).astype(np.uint8)
            Image.fromarray(values).save(folder / f"{scene}{name}.png")
