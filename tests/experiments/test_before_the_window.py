"""The experiments without a window: what is refused in one sentence, the pictures of the cube, scales, the tube."""

import math
import os
import subprocess
import sys
import types
from pathlib import Path

import numpy as np
import pytest
from headless import PROGRAMS, make_set, psychopy_here

from focalgradient.design import NeckerDesign
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.experiments.pinhole import through_tube, whole_field
from focalgradient.lab import EXPERIMENTS, preparation, run
from focalgradient.scenes import departure_from_rigid
from focalgradient.stimuli import cube_frames, read_set


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, without a display."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("DISPLAY", raising=False)
    make_set(tmp_path / "set", ["spheres-00", "spheres-01"], (40, 30))
    (tmp_path / "short.toml").write_text('task = "depthrating"\nscenes = ["spheres-01"]\nrepetitions = 1\n')
    return tmp_path


def refused(capsys: pytest.CaptureFixture[str], program: str, *options: object) -> str:
    """The sentence with which a program refuses to run."""
    assert run(EXPERIMENTS[program], list(map(str, options))) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("Error: ")
    assert said.err.count("\n") == 1
    return said.err


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ("--participant 0_1", "the participant label is '0_1', but must be letters and digits only"),
        ("--participant 01 --resume", "there is no such session to resume; begin it"),
        ("--participant 01 --stimuli set", "--stimuli is given, but this design shows no pictures of a set"),
        ("--participant 01", "there is no display (DISPLAY is not set): run this on a machine with a screen"),
    ],
)
def test_what_is_wrong_is_said_before_a_window_opens(place, capsys, given, sentence):
    assert sentence in refused(capsys, "necker", *given.split())


def test_pictures_that_are_missing_or_changed(place, capsys):
    given = ["--participant", "01", "--design", "short.toml"]
    assert "give --stimuli DIR" in refused(capsys, "depth-rating", *given)
    given += ["--stimuli", "set"]
    assert "there is no display" in refused(capsys, "depth-rating", *given)
    more = ["--participant", "01", "--stimuli", "set"]
    assert "the set in set has no picture of 'spheres-02'" in refused(capsys, "depth-rating", *more)
    (place / "mm.toml").write_text((place / "short.toml").read_text() + "focal_length_mm = 28.0\n")
    assert "the pictures were made with 50: set it to 50" in refused(
        capsys, "depth-rating", *given, "--design", "mm.toml"
    )
    (place / "set" / "spheres-01" / "pinhole.png").unlink()
    assert "pinhole.png is in the manifest but cannot be read" in refused(capsys, "depth-rating", *given)


@pytest.mark.slow
@psychopy_here
def test_a_display_that_does_not_answer(place):
    environment = {**os.environ, "DISPLAY": ":4095", "HOME": str(place)}
    command = [sys.executable, str(PROGRAMS / "necker_rotation.py"), "--participant", "01"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, cwd=place)
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith("Error: no window can be opened (")
    assert not (place / "data").exists()


MONITORS = {
    "lab": (0.531, 0.57, (1920, 1080), 2.2, None, None),
    "bare": (None, None, None, None, None, None),
    None: (None,) * 6,
    "old": (0.4, 0.57, (1280, 1024), None, None, None),
    "far": (0.531, 0.80, (1920, 1080), 1.0, None, None),
    "measured": (0.531, 0.57, (1920, 1080), 2.2, (2.1, 2.2, 2.4), 87.5),
}


def display_of(folder: Path, given: str) -> tuple[Display, bool, list[str]]:
    """What is known of a screen of 1920 x 1080 pixels, by the options."""
    screen = types.SimpleNamespace(
        screen_size=lambda number: (1920, 1080),
        calibration_of=lambda name: types.SimpleNamespace(
            **dict(zip(("width", "distance", "size_px", "gamma", "channels", "white"), MONITORS[name], strict=True))
        ),
    )
    options = preparation._options(EXPERIMENTS["depth-rating"], given.split(), "run")
    return preparation._display(options, screen, read_set(folder / "set"))


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (
            "",
            "the screen's size and viewing distance are unknown: enter them in PsychoPy's Monitor Center and give "
            "--monitor",
        ),
        ("--monitor bare", "'bare' has no width or no viewing distance: enter them in PsychoPy's Monitor Center"),
        ("--monitor old", "'old' was calibrated at 1280 x 1024 pixels, but the screen has 1920 x 1080"),
        ("--monitor far", r"the screen has 50\.\d\d: change the viewing distance to 0\.5\d\d m"),
        ("--uncalibrated --windowed", "the pictures have 1100 x 100 pixels, but the window has only 1024 x 768"),
    ],
)
def test_screens_that_are_not_calibrated_or_too_small_are_refused(tmp_path, given, sentence):
    make_set(tmp_path / "set", ["spheres-00"], (1100, 100), pixel_pitch_mm=0.2766)
    with pytest.raises(InputError, match=sentence):
        display_of(tmp_path, given)


def test_screens_that_are_calibrated_give_degrees_and_gamma(tmp_path):
    make_set(tmp_path / "set", ["spheres-00"], (1100, 100), pixel_pitch_mm=0.2766)
    display, calibrated, warnings = display_of(tmp_path, "--monitor lab")
    assert calibrated
    assert display.gamma == 2.2
    assert display.pixels_per_degree == pytest.approx(57 * math.tan(math.radians(1)) / (53.1 / 1920), rel=0.001)
    assert warnings == []
    display, calibrated, warnings = display_of(tmp_path, "--monitor far --uncalibrated")
    assert warnings == ["the pictures were made for a gamma of sRGB, but the screen's is 1.00."]
    display, calibrated, warnings = display_of(tmp_path, "--monitor measured")
    assert (display.gamma, display.white) == ((2.1, 2.2, 2.4), 87.5)
    assert warnings == [
        "the gammas of red, green and blue are 2.10, 2.20 and 2.40: they differ by 0.30, more than 0.1, "
        "so that greys of pictures made for another gamma are not neutral: make them with --gamma 2.10,2.20,2.40."
    ]
    display, calibrated, warnings = display_of(tmp_path, "--pilot")
    assert not calibrated
    assert warnings == ["the screen's gamma has not been measured: light is encoded for the sRGB curve."]


PIXEL = math.radians(1 / 30)
SHORT = NeckerDesign(turns_per_s=0.5, size_deg=4.0, line_width_deg=0.1)


def example(shape: str):
    return next(trial for trial in SHORT.trials("01") if trial.shape == shape)


def test_the_rigid_example_hides_what_is_behind():
    solid = cube_frames.cube_of(SHORT)
    counts = {int(cube_frames._in_sight(solid.vertices(turn)).sum()) for turn in np.arange(0, 0.25, 0.01)}
    assert counts <= {7, 9}  # edges of two faces, or of three
    wires = {trial.shape: trial for trial in SHORT.trials("01")}
    drawn = {
        shape: sum(float(light.sum()) for light in cube_frames.frames_of(trial, SHORT, 6, PIXEL))
        for shape, trial in wires.items()
    }
    assert 0.6 < drawn["rigid"] / drawn["ambiguous"] < 0.85


def test_the_nonrigid_example_is_rigid_in_no_reading():
    solid, turns = cube_frames.cube_of(SHORT), np.arange(120) / 120
    shape = np.stack([cube_frames.wobbling(solid, turn) for turn in turns])
    mirrored = shape * (2 * solid.distance - shape[..., 2:]) / shape[..., 2:]
    price = departure_from_rigid(np.stack([solid.reversed(turn) for turn in turns])).whole
    assert departure_from_rigid(shape).whole > price
    assert departure_from_rigid(mirrored).whole > price


@pytest.mark.parametrize("shape", ["ambiguous", "rigid", "nonrigid"])
def test_a_quarter_turn_closes_without_a_seam(shape):
    frames = [*cube_frames.frames_of(example(shape), SHORT, 60, PIXEL)]
    after = [*frames[1:], frames[0]]
    steps = [float(np.abs(later - sooner).mean()) for sooner, later in zip(frames, after, strict=True)]
    assert steps[-1] < 1.5 * max(steps[:-1])
    assert all(light.shape == cube_frames.shape_of(SHORT, PIXEL) for light in frames)
    rim = max(float(np.concatenate([light[0], light[-1], light[:, 0], light[:, -1]]).max()) for light in frames)
    assert rim < 0.01  # the picture holds all of it


def test_the_cube_turns_at_its_speed_on_any_display():
    assert cube_frames.frame_count(NeckerDesign(), 60.0) == 120
    assert cube_frames.frame_count(NeckerDesign(), 59.94) == 120
    assert cube_frames.frame_count(NeckerDesign(), 143.98) == 288


def test_the_tube_leaves_a_round_field_of_the_right_angle():
    display = Display(size_px=(1920, 1080), pixel_pitch=0.25e-3, distance=0.6)
    wide = 2 * 0.6 / 0.25e-3 * math.tan(math.radians(5))
    field = through_tube(np.full((700, 801, 3), 9, np.uint8), (300.0, 350.0), wide) > 0
    assert display.degrees(field[350, :, 0].sum()) == pytest.approx(10, rel=0.01)
    assert field[..., 1].sum() == pytest.approx(math.pi * wide**2 / 4, rel=0.01)
    columns = np.flatnonzero(field.any(axis=(0, 2)))
    assert (columns[0] + columns[-1] + 1) / 2 == pytest.approx(300, abs=0.5)


def test_the_round_field_is_never_cut_by_the_border_of_the_picture():
    for about in ((0.0, 0.0), (40.0, 90.0), (399.0, 20.0), (200.0, 150.0)):
        middle = whole_field(about, (300, 400, 3), 101.0)
        field = through_tube(np.full((300, 400, 3), 9, np.uint8), middle, 101.0) > 0
        assert field[..., 0].sum() == pytest.approx(math.pi * 101**2 / 4, rel=0.01)
        assert math.dist(middle, about) <= math.hypot(51, 51)
    assert whole_field((200.0, 150.0), (300, 400, 3), 101.0) == (200.0, 150.0)


def test_a_tone_is_played_by_what_is_there(tmp_path, monkeypatch):
    import wave

    from focalgradient.lab.devices import sound

    monkeypatch.setenv("PATH", str(tmp_path))
    if os.name == "posix":
        assert not sound.tone()
        (tmp_path / "aplay").write_text(f"#!/bin/sh\n/bin/cp $2 {tmp_path}/heard.wav\n")
        (tmp_path / "aplay").chmod(0o755)
        assert sound.tone()
        sound.PLAYING[-1].wait()
        with wave.open(str(tmp_path / "heard.wav")) as file:
            samples = np.frombuffer(file.readframes(file.getnframes()), "<i2")
            strongest = np.abs(np.fft.rfft(samples)).argmax() * file.getframerate() / len(samples)
        assert strongest == pytest.approx(880, abs=4)
