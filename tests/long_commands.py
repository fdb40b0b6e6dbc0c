"""Commands that write, with small inputs: what `killing_commands.py` kills."""

from __future__ import annotations

import json
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parent / "web")]

import participant  # noqa: E402
import test_collect  # noqa: E402
from recorded import record_necker, record_ratings  # noqa: E402
from two_views import TOML, picture, write  # noqa: E402

from focalgradient import Lens  # noqa: E402
from focalgradient.display import Display  # noqa: E402
from focalgradient.stimuli import blurred_edge  # noqa: E402
from focalgradient.stimuli.drawn_files import SUMMARY, stimulus_files  # noqa: E402

OPTICS = ("--focal-length", "25", "--pixel-pitch", "8", "--f-number", "16", "--f-number", "5.6")
OPTICS += ("--focus-distance", "0.85")
SMALL = ("--gradient", "none", "--size", "256", "--edge", "3", "--speed", "0.5")
PICTURES = ("--seed", "1", "--scenes", "1", "--size", "64", "--samples", "4", "--engine", "cast", "--apertures", "4")
LENS = ("--f-number", "4", "--focal-length", "25", "--focus", "0.8", "--focus", "2", "--field", "6")
FEW = ("--subjects", "3", "--experiments", "3")
SOME = ("--observers", "3", "--seed", "1")
NECKER = 'task = "necker"\nrepetitions = 1\nstrengths_mm = [4.0]\ndirections = ["right"]\ntrial_s = 20.0\n'
RATING = 'task = "depthrating"\nscenes = ["spheres-00", "spheres-01"]\nrepetitions = 1\n'
THRESHOLD = 'task = "blurthreshold"\nrepetitions = 1\nscenes = ["spheres-00"]\ncatch_trials = 1\npractice_trials = 0\n'


@dataclass(frozen=True, slots=True)
class Long:
    """A command that writes.

    Parameters
    ----------
    args
        Its words; ``--out out`` is added where it writes to ``out``.
    summary
        Of the set of results: stands only beside all the others, and is replaced with them; none where it resumes.
    where
        The folder it writes to.
    given
        The folder it changes, a copy of which stands in its place before each run; none where it makes a new one.
    once
        Whether what is done cannot be done again, and is refused.
    """

    args: tuple[str, ...]
    summary: str | None = None
    where: str = "out"
    given: str | None = None
    once: bool = False

    @property
    def words(self) -> tuple[str, ...]:
        return self.args if "--out" in self.args or self.where != "out" else (*self.args, "--out", "out")


TWO, ONE = ("--workers", "2"), ("--workers", "1")
COMMANDS: dict[str, Long] = {
    "depth": Long(("depth", "a.png", "b.png", *OPTICS, "--focus-distance", "0.85"), "summary.json"),
    "frames": Long(("depth", "f0.toml", "f1.toml", "--psf", "gaussian", *ONE)),
    "frames, two workers": Long(("depth", "f0.toml", "f1.toml", "--psf", "gaussian", *TWO)),
    "calibrate": Long(("calibrate", "targets.toml", "--out", "out/camera.toml"), "camera.toml"),
    "calibrate --sheet": Long(("calibrate", "--sheet", "a4", "--out", "out/sheet.pdf"), "sheet.pdf"),
    "stream": Long(("stream", "a.avi", "--out", "out/d.avi", "--values", "out/d.npy", *OPTICS), "d.json"),
    "blur": Long(("blur", "a.png", "far.npy", *LENS), "summary.json"),
    "eye": Long(("eye", "plane", *ONE), "summary.json"),
    "eye --accommodate": Long(("eye", "--accommodate", "course.csv"), "summary.json"),
    "report": Long(("report", "data", *ONE), "report.html"),
    "power depth-rating": Long(("power", "depth-rating", *FEW, "--design", "rating.toml", *ONE)),
    "power necker": Long(("power", "necker", *FEW, "--design", "necker.toml", *TWO)),
    "simulate depth-rating": Long(("simulate", "depth-rating", *SOME, "--design", "rating.toml", *ONE)),
    "simulate necker": Long(("simulate", "necker", *SOME, "--design", "necker.toml", *TWO)),
    "simulate blur-threshold": Long(("simulate", "blur-threshold", *SOME, "--design", "threshold.toml", *ONE)),
    "stimuli necker": Long(("stimuli", "necker", *SMALL, *ONE)),
    "stimuli depth-rating": Long(("stimuli", "depth-rating", *PICTURES, "--pixel-pitch", "3000", *ONE)),
    "stimuli import": Long(("stimuli", "import", "own", "--table", "own/pictures.csv", "--pixel-pitch", "3000")),
    "stimuli set": Long(("stimuli", "set", "drawn")),
    "stimuli texture-border": Long(("stimuli", "texture-border", "--width-deg", "20"), "stimulus.json"),
    "demo": Long(("demo",)),
    "serve --export": Long(
        ("serve", "study.toml", "--export", "study", "--participants", "3"), None, "study", once=True
    ),
    "collect": Long(("collect", "answers.txt", "--data", "collected"), None, "collected"),
    "validate --export": Long(("validate", "cut", "--export"), None, "cut", "cut"),
    "repair": Long(("repair", "damaged"), None, "damaged", "damaged"),
    "withdraw": Long(("withdraw", "data", "sub-02", "--yes"), None, "data", "data", once=True),
}


def prepare(folder: Path) -> None:
    """What the commands are given."""
    noise = np.random.default_rng(1).standard_normal((96, 96))
    texture = np.clip(0.5 + 0.15 * cv2.GaussianBlur(noise, (0, 0), 1.2) / 0.23, 0.02, 0.98)
    soft = cv2.GaussianBlur(texture, (0, 0), 1.2)
    for name, image in (("a.png", texture), ("b.png", soft)):
        cv2.imwrite(str(folder / name), np.rint(65535 * image).astype(np.uint16))
    writer = cv2.VideoWriter(str(folder / "a.avi"), cv2.CAP_FFMPEG, cv2.VideoWriter.fourcc(*"MJPG"), 10, (96, 96))
    for number in range(40):
        frame = np.rint(255 * (soft if number % 2 else texture)).astype(np.uint8)
        writer.write(cv2.cvtColor(frame, cv2.COLOR_GRAY2BGR))
    writer.release()
    lines = ["[camera]", "focal_length_mm = 25", "pixel_pitch_um = 8"]
    lens = Lens(0.025, 8, 0.35)
    for distance in (0.5, 0.7, 1.1, 2.0):
        sigma = 0.5 * float(lens.blur_radius(distance)) * lens.sensor_distance / 8e-6
        square = np.full((128, 160), 0.75)
        square[35:90, 38:105] = 0.06
        cv2.imwrite(
            str(folder / f"{distance}.png"), np.rint(65535 * cv2.GaussianBlur(square, (0, 0), sigma)).astype("u2")
        )
        lines += ["[[view]]", f'image = "{distance}.png"', f"distance_m = {distance}", "f_number = 8"]
    (folder / "targets.toml").write_text("\n".join(lines))
    for name in ("f0.toml", "f1.toml"):
        (folder / name).write_text(TOML.replace("a.png", "near.png").replace("b.png", "soft.png"))
    for name, f_number in (("near.png", 16), ("soft.png", 5.6)):
        write(folder / name, picture(f_number))
    np.save(folder / "far.npy", np.where(np.arange(96) < 48, 0.8, 2.0) * np.ones((96, 1)))
    (folder / "course.csv").write_text("0,1\n0.2,1\n0.2,2\n0.5,2\n")
    for name, design in (("necker", NECKER), ("rating", RATING), ("threshold", THRESHOLD)):
        (folder / f"{name}.toml").write_text(design)
    _own_pictures(folder / "own")
    drawn, summary = stimulus_files(blurred_edge(width_deg=1, height_deg=1, pixels_per_degree=35.95), Display())
    (folder / "drawn").mkdir()
    for name, data in {**drawn, SUMMARY: json.dumps(summary).encode()}.items():
        (folder / "drawn" / name).write_bytes(data)
    _data_sets(folder)
    (folder / "study.toml").write_text(participant.NECKER)
    (folder / "answers").mkdir()
    (folder / "answers.txt").write_text(test_collect.text(test_collect.session(folder / "answers")))


def _own_pictures(folder: Path) -> None:
    folder.mkdir()
    lines = ["file,scene,aperture,fixation"]
    for number, aperture in enumerate(("pinhole", "f/4")):
        picture = np.full((64, 64, 3), 60 + 60 * number, np.uint8)
        cv2.imwrite(str(folder / f"{number}.png"), picture)
        lines.append(f"{number}.png,a,{aperture},nearest")
    (folder / "pictures.csv").write_text("\n".join(lines) + "\n")


def _data_sets(folder: Path) -> None:
    """A whole data set, one whose tables are missing, and one with a damaged journal and a changed table."""
    record_necker(record_ratings(folder / "data", 3), 3)
    for name in ("cut", "damaged"):
        shutil.copytree(folder / "data", folder / name)
    for path in (folder / "cut").glob("sub-*/beh/*"):
        path.unlink()
    first, second, *_ = sorted((folder / "damaged").rglob("*.jsonl"))
    lines = first.read_bytes().splitlines(keepends=True)
    first.write_bytes(b"".join([*lines[:4], lines[4][:20] + b"\n", *lines[5:]]))
    table = folder / "damaged" / second.parent.parent.name / "beh" / f"{second.stem}.tsv"
    table.write_text(table.read_text().replace("1.5", "1.6"))
