"""The experiments in real windows, with real keys: from the first screen to a valid data set, killed or not."""

import hashlib
import json
import math
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from headless import PAGES, Headless, Running, design, headless, keep, make_set, psychopy_here

from focalgradient.dataset import bids_problems, read_dataset, read_journal, validate
from focalgradient.design import load_design
from focalgradient.display import Display
from focalgradient.experiments.pinhole import through_tube
from focalgradient.stimuli import cube_frames, read_set

pytestmark = psychopy_here

DOCTOR = [sys.executable, "-c", "from focalgradient.cli import main; main()", "doctor", "--seconds", "0.3"]
WIDTH_CM, DISTANCE_CM = 30.0, 57.0
DISPLAY = Display((1024, 768), WIDTH_CM / 100 / 1024, DISTANCE_CM / 100)

HUB = """
import sys, types

class Hub:
    @classmethod
    def getActiveConnection(cls):
        return cls()

    def sendMessageEvent(self, text, category="", offset=0.0, sec_time=None):
        print("hub", category, text, flush=True)

sys.modules["psychopy.iohub.client"] = types.SimpleNamespace(ioHubConnection=Hub)
"""


Test = Callable[[Headless, Path], None]
TESTS: dict[str, Test] = {}


def beside_others(test: Test) -> Callable[[Mapping[str, Future[None]]], None]:
    """Run a test, on a screen of its own, at the same time as the others of this file: all of them mostly wait."""

    def awaited(running: Mapping[str, Future[None]]) -> None:
        running[test.__name__].result()

    awaited.__name__ = test.__name__
    TESTS[test.__name__] = test
    return awaited


@pytest.fixture(scope="module")
def running(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory):
    chosen = [item.name for item in request.session.items if item.name in TESTS]
    folders = {name: tmp_path_factory.mktemp(name[5:25]) for name in chosen}
    with ThreadPoolExecutor(2) as pool:
        yield {name: pool.submit(_on_a_screen, TESTS[name], folder) for name, folder in folders.items()}


def _on_a_screen(test: Test, folder: Path) -> None:
    with headless(folder / "x") as screen:
        monitors = screen.folder / "home" / ".psychopy3" / "monitors"
        monitors.mkdir(parents=True)
        known = {"calibDate": 1.0, "width": WIDTH_CM, "distance": DISTANCE_CM, "sizePix": [1024, 768], "gamma": 1.8}
        known |= {"notes": "", "psychopyVersion": "2026.2.5", "usebits": False}
        (monitors / "lab.json").write_text(json.dumps({"2026_01_01 00:00": known}))
        test(screen, folder)


def until(condition: Callable[[], bool], seconds: float = 1.0) -> bool:
    """Whether it comes true within that time."""
    end = time.monotonic() + seconds
    while not (true := condition()) and time.monotonic() < end:
        time.sleep(0.005)
    return true


def is_shown(screen: Headless, pixels: np.ndarray) -> bool:
    """Whether these stand in the middle of the screen, value for value."""
    found, (height, width) = screen.pixels(), pixels.shape[:2]
    top, left = (found.shape[0] - height) // 2, (found.shape[1] - width + 1) // 2
    return bool((found[top : top + height, left : left + width] == pixels).all())


def _is_any(found: np.ndarray, pictures: list[np.ndarray]) -> bool:
    """Whether one of these grey pictures, all of one even size, stands in the middle of a screen."""
    (height, width), (high, wide) = found.shape[:2], pictures[0].shape
    middle = found[(height - high) // 2 : (height + high) // 2, (width - wide) // 2 : (width + wide) // 2]
    return any((middle == picture[..., None]).all() for picture in pictures)


def assert_whole(data: Path, trials: int, stimuli: Path | None = None) -> None:
    found = validate(data, stimuli)
    assert found.problems == ()
    assert found.trials == trials
    assert bids_problems(data) == []


RATING: dict[str, Any] = {"fixations": ["nearest"], "catch_trials": 1, "practice_trials": 1, "standard_every": 2}
RATING |= {"break_every": 2, "least_break_s": 0.2, "catch_pictures": ["standard"], "mark_s": 0.2, "picture_s": 0.4}
RATING |= {"standard_s": 0.2, "blank_s": 0.5, "pause_s": 0.5, "answer": "typed", "confidence": True}


class Rater:
    """Somebody who takes part in experiment 1, and checks that each picture is what the design and the set say."""

    def __init__(self, screen: Headless, folder: Path):
        self.screen, self.folder, self.recorded = screen, folder, 0
        self.design = load_design(folder / "rating.toml")
        self.set = read_set(folder / "set")
        self.trials = self.design.trials("a7")
        self.pictures: Counter[bool] = Counter()
        self.events: list[str] = []
        self.patches: list[int] = []

    def take_part(self, *options: object, stop: tuple[str, int] | None = None) -> Running:
        """Answer until the end, or until an event has come so many times."""
        given = ["--data", self.folder / "data", "--stimuli", self.folder / "set", "--uncalibrated"]
        given += ["--design", self.folder / "rating.toml", "--photodiode", "right"]
        running = Running(self.screen, "depth_rating", *given, *options)
        came: Counter[str] = Counter()
        for event in running.events():
            self.events.append(event)
            came[event] += 1
            if stop == (event, came[event]):
                break
            self.meet(event)
        return running

    def meet(self, event: str) -> None:
        keys = self.screen.keys
        if event == "form":
            keys("Return", "Return", "Return", "Return", "Return")  # without a label: it is asked for again
            keys("b", "BackSpace", "a", "7", "Return", "Tab", "3", "4", "Return")
            keys("f", "Return", "r", "i", "g", "h", "t", "Return")
        elif event == "consent":
            keys("space" if self.events.count("consent") == 1 else "y")
        elif event in PAGES:
            keys("space")
        elif event == "picture":
            trial = self.trials[self.recorded]
            picture = self.set.picture(trial.scene, trial.aperture, trial.fixation)
            self.pictures[until(lambda: is_shown(self.screen, self.set.pixels(picture)), 0.3)] += 1
            self.patches.append(int(self.screen.pixels()[-5, -5].min()))
        elif event == "question":
            self.patches.append(int(self.screen.pixels()[-5, -5].max()))
            keys("9", "Return", "BackSpace", "1", "period", str(self.recorded), "Return")
        elif event == "confidence":
            keys("Right", "Right", "Return")
        elif event == "recorded":
            self.recorded += 1


@pytest.mark.slow
@beside_others
def test_experiment_1_from_form_to_data_set_through_two_kills(screen, tmp_path):
    make_set(tmp_path / "set", ["spheres-00", "spheres-01"])
    (tmp_path / "rating.toml").write_text(design("depthrating", **RATING))
    (tmp_path / "consent.txt").write_text("Consent\nI take part of my own free will.\fPage 2\nI can stop at any time.")
    rater = Rater(screen, tmp_path)

    first = rater.take_part("--consent", tmp_path / "consent.txt", stop=("question", 2))
    first.process.send_signal(signal.SIGKILL)
    assert first.end() == -signal.SIGKILL
    journal = next(tmp_path.glob("data/sourcedata/sub-a7/beh/*.jsonl"))
    assert len(read_journal(journal).of("trial")) == rater.recorded == 1
    assert rater.events[:5] == ["consent", "consent", "form", "sitting", "instructions"]

    again = ("--participant", "a7", "--resume")
    second = rater.take_part(*again, stop=("picture", 2))
    second.process.send_signal(signal.SIGTERM)
    assert second.end() == 143
    assert "Interrupted: 2 answers are saved in " in second.errors
    assert len(read_journal(journal).of("trial")) == rater.recorded == 2

    third = rater.take_part(*again)
    assert third.end() == 0, third.errors
    assert rater.pictures == {True: len(rater.trials) + 1}  # one was on the screen when the program was killed
    assert set(rater.patches) == {0, 255}  # black with a question, white with a picture
    assert rater.patches[:2] == [255, 0]
    table = read_dataset(tmp_path / "data").depth_rating
    assert table["rating"].tolist() == [1.1, 1.2, 1.3]
    assert table["confidence"].between(0, 1).all()
    assert table["confidence"].nunique() == 3  # from wherever the marker came
    assert (table["response_time"] > 0).all()
    assert table["sitting"].tolist() == [2, 3, 3]
    # One trial was on the screen at each kill: the first main trial at its question, the second at its picture.
    assert table["interruptions"].tolist()[:2] == [1, 1]
    assert table["interruptions"].isna().tolist() == [False, False, True]
    people = read_dataset(tmp_path / "data").participants
    assert people.iloc[0].to_dict() == {
        "participant_id": "sub-a7",
        "kind": "human",
        "age": 34,
        "sex": "f",
        "handedness": "right",
    }
    assert_whole(tmp_path / "data", 3, tmp_path / "set")


WATCHING: dict[str, Any] = {"gradients": ["none", "nonrigid"], "strengths_mm": [4.0], "directions": ["left"]}
WATCHING |= {"repetitions": 1, "practice_trials": 1, "catch_trials": 1, "trial_s": 1.6, "practice_s": 1.0}
WATCHING |= {"practice_rounds": 1, "turns_per_s": 0.75, "size_deg": 5.0, "line_width_deg": 0.08, "keys": ["f", "left"]}


@pytest.mark.slow
@beside_others
def test_experiment_2_keeps_every_press_with_its_time(screen, tmp_path):
    (tmp_path / "watching.toml").write_text(design("necker", **WATCHING))
    (screen.folder / "markers.py").write_text((screen.folder / "markers.py").read_text() + HUB)
    made = load_design(tmp_path / "watching.toml")
    trials, done, held, asked = made.trials("03"), 0, [], 0
    pixel_angle, shown = DISPLAY.pixel_pitch / DISPLAY.distance, Display((1024, 768), gamma=1.8).encode
    lights = cube_frames.frames_of(trials[1], made, cube_frames.frame_count(made, 60.0), pixel_angle)
    frames = [shown(0.5 * light) for light in lights]
    given = ["--participant", "03", "--session", "2", "--data", tmp_path / "data"]
    running = Running(
        screen, "necker", *given, "--design", tmp_path / "watching.toml", "--monitor", "lab", "--windowed"
    )
    for event in running.events():
        if event in PAGES:
            screen.keys("space")
        elif event == "cube" and done == 2 and not asked:
            asked += 1
            screen.keys("Escape")
        elif event == "quit?":
            screen.keys("n")
        elif event == "cube":
            if done == 1:
                assert until(lambda: _is_any(screen.pixels(), frames), 1.5)
                continue
            start = time.monotonic()
            screen.press("f")
            screen.press("Left")
            screen.release("f")
            screen.release("Left")
            screen.keys("f")
            held.append(time.monotonic() - start)
        elif event == "recorded":
            done += 1
    assert running.end() == 0, running.errors
    assert running.errors.count("Warning") == running.errors.count("no vertical synchronisation") == 1  # calibrated
    assert asked == 1
    log = read_journal(next((tmp_path / "data").rglob("*.jsonl")))
    assert log.head["keys"] == {"rigid": "left", "nonrigid": "f"}
    assert log.head["apparatus"]["gamma"] == pytest.approx(1.8)
    assert log.head["apparatus"]["screen_m"] == pytest.approx([0.3, 0.225])
    by_number = [event["presses"] for event in log.of("trial")]
    assert [len(presses) for presses in by_number] == [6, 0, 6, 6]
    for presses, seconds in zip([by_number[0], *by_number[2:]], held, strict=True):
        assert [(key, down) for _, key, down in presses] == [
            *[("f", True), ("left", True), ("f", False), ("left", False), ("f", True), ("f", False)]
        ]
        times = [time for time, _, _ in presses]
        assert times == sorted(times)
        assert 0 < times[-1] - times[0] <= seconds
    table = read_dataset(tmp_path / "data").necker
    assert table[table["trial"] == 1]["percept"].tolist() == ["none"]
    percepts = table[table["trial"] == 2]["percept"].tolist()
    assert percepts == ["none", "nonrigid", "both", "rigid", "none", "nonrigid", "none"]
    assert table["trial_duration"].between(1.55, 1.8).all()
    digest = hashlib.sha256(b"".join(frame.tobytes() for frame in frames)).hexdigest()
    assert {*table["shown_sha256"][table["trial"] == trials[1].trial]} == {digest}
    assert {*table["interruptions"][table["trial"] == 2]} == {1}
    assert table["interruptions"][table["trial"] != 2].isna().all()
    notes = [name for note in log.of("note") if note["kind"] == "events" for name, _, _ in note["events"]]
    assert Counter(notes)["cube"] == 5  # one was interrupted, and shown again
    assert "focalgradient cube" in running.hub
    assert_whole(tmp_path / "data", 3)


SHOWN = design("pinhole", scenes=["spheres-01"], repetitions=1, look_s=0.3, picture_s=0.5, field_deg=8.0)


@beside_others
def test_the_demonstration_shows_pictures_exactly_and_fields_in_degrees(screen, tmp_path):
    pitch = DISPLAY.pixel_pitch * 1e3
    make_set(tmp_path / "set", ["spheres-01"], (400, 399), pixel_pitch_mm=pitch, distance_m=0.57)
    (tmp_path / "show.toml").write_text(SHOWN)
    trials, stimuli, done = load_design(tmp_path / "show.toml").trials("02"), read_set(tmp_path / "set"), 0
    given = ["--participant", "02", "--data", tmp_path / "data", "--stimuli", tmp_path / "set"]
    running = Running(
        screen, "pinhole_demonstration", *given, "--design", tmp_path / "show.toml", "--monitor", "lab", "--eye", "left"
    )
    events = []
    for event in running.events():
        events.append(event)
        if event in PAGES:
            screen.keys("space")
        elif event == "mark":
            x, y = 512 - 200 + 40, 384 - 199.5 + 90  # where the set says that the nearest object is
            assert until(lambda x=x, y=y: screen.pixels()[round(y), round(x) + 8].min() == 255)
        elif event == "picture":
            trial = trials[done]
            picture = stimuli.picture(trial.scene, "pinhole" if trial.viewing == "pinhole" else "f/5.6", "nearest")
            pixels = stimuli.pixels(picture)
            if trial.viewing != "natural":
                wide = 2 * DISPLAY.distance / DISPLAY.pixel_pitch * math.tan(math.radians(4))
                pixels = through_tube(pixels, (wide / 2, wide / 2), wide)  # whole, with (40, 90) in it
            assert until(lambda pixels=pixels: is_shown(screen, pixels), 0.4)
        elif event == "question" and done == 5:
            screen.keys("Escape")
        elif event in ("quit?", "keep?"):
            screen.keys("y")
        elif event == "question":
            screen.click(512 + 100, 384 + 38)
            screen.keys("Return")
        elif event == "recorded":
            done += 1
    assert running.end() == 1
    assert "Stopped; 1 trial is left: continue with --resume." in running.errors
    found = validate(tmp_path / "data", tmp_path / "set")
    assert len(found.problems) == 1
    assert "1 of 6 trials of the design are missing (the first is 6): resume the session" in found.problems[0]
    assert Counter(events)["block"] == Counter(events)["standard"] == 2  # pictures, then the real world
    about = json.loads(next((tmp_path / "data").glob("sub-02/beh/*.json")).read_text())["Participant"]
    assert about == {"eye": "left"}
    assert bids_problems(tmp_path / "data") == []
    ratings = read_dataset(tmp_path / "data").pinhole["rating"]
    half = 0.9 * 768 / 2
    assert ratings.tolist() == pytest.approx([0.25 * 16 ** ((100 / half + 1) / 2)] * 5, rel=0.01)


@beside_others
def test_the_doctor_tells_what_is_well_and_what_is_not(screen, tmp_path):
    command = [*DOCTOR, "--monitor", "lab"]
    run = subprocess.run(command, env=screen.environment, capture_output=True, text=True, cwd=screen.folder)
    assert run.returncode == 1, run.stderr
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in run.stdout.splitlines()[2:]]
    lines = {name: (word, measured) for word, name, measured, _, _ in rows}
    assert lines["pixels per degree"] == ("ok", f"{DISPLAY.pixels_per_degree:.2f} (0.300 m wide, viewed from 0.570 m)")
    assert lines["gamma"] == ("ok", "1.80")
    assert lines["graphics"][0] == "WRONG"
    assert "llvmpipe" in lines["graphics"][1]
    assert lines["keyboard"][0] == lines["safe writing"][0] == lines["disk space"][0] == "ok"
    assert "psychopy 2026.2.5" in lines["versions"][1]
    assert lines["clock"][0] == "ok"
    assert lines["device pixels"] == ("ok", "1024 x 768 for a window of 1024 x 768")
    assert {"screen", "refresh rate", "dropped frames", "frames"} <= set(lines)


LOOKING = """
import pathlib, struct

class LS100:
    OK = True

    def __init__(self, port):
        self.folder = pathlib.Path(port)
        self.OK = self.folder.exists()

    def getLum(self):
        content = (self.folder / "Xvfb_screen0").read_bytes()
        header = struct.unpack(">25I", content[:100])
        at = header[0] + 12 * header[19] + header[12] * (header[5] // 2) + 4 * (header[4] // 2)
        blue, green, red = content[at : at + 3]
        shares = ((red / 255) ** 2.0, (green / 255) ** 2.2, (blue / 255) ** 2.4)
        return 0.5 + 20 * shares[0] + 60 * shares[1] + 10 * shares[2]
"""


@pytest.mark.slow
@beside_others
def test_a_photometer_measures_the_table_that_one_would_write_by_hand(screen, tmp_path):
    """A stand-in for PsychoPy's package looks at the middle of the real screen, whose guns it gives gammas."""
    (tmp_path / "psychopy_minolta").mkdir()
    (tmp_path / "psychopy_minolta" / "__init__.py").touch()
    (tmp_path / "psychopy_minolta" / "minolta.py").write_text(LOOKING)
    environment = {**screen.environment, "PYTHONPATH": f"{tmp_path}:{os.environ.get('PYTHONPATH', '')}"}
    table = tmp_path / "measured.csv"

    def doctor(device: str) -> subprocess.Popen[str]:
        command = [*DOCTOR, "--luminance", str(table), "--photometer", device, "--json"]
        pipe = subprocess.PIPE
        return subprocess.Popen(command, env=environment, stdout=pipe, stderr=pipe, text=True, cwd=screen.folder)

    running = doctor(f"LS100:{screen.folder}")
    deadline = time.monotonic() + 120
    while not (screen.pixels()[384, 512] == 255).all():
        assert time.monotonic() < deadline
        time.sleep(0.2)
    keep(screen, "doctor-photometer")
    screen.keys("Return")
    said, errors = running.communicate(timeout=120)
    assert running.returncode == 1, errors
    checks = {one["name"]: one for one in json.loads(said)["checks"]}
    assert "red 2.00, green 2.20, blue 2.40" in checks["luminance"]["measured"]
    assert "white 90.5" in checks["luminance"]["measured"]
    assert len(table.read_text().splitlines()) == 17
    table.write_text("level,grey\n")
    (tmp_path / "measured-fit.png").unlink()
    _, errors = doctor(f"LS100:{screen.folder}").communicate(timeout=120)
    assert "measured.csv is there already and was not written by 'focalgradient doctor'" in errors
    table.unlink()
    absent = doctor("LS100:nowhere")
    assert "the photometer LS100:nowhere does not respond: switch it on" in absent.communicate(timeout=120)[1]
    assert absent.returncode == 2
    assert not table.exists()


@pytest.mark.slow
@beside_others
def test_the_doctor_stores_a_photometer_table_times_triggers_and_measures_by_a_card(screen, tmp_path):
    """The card fills 292 of 1024 pixels of a screen 0.3 m wide: the frame is made as wide by the arrow keys."""
    table = ["level,red,green,blue,grey"]
    for level in range(0, 256, 15):
        light = [white * (level / 255) ** gamma for white, gamma in ((20, 2.0), (60, 2.2), (10, 2.4))]
        table.append(",".join(f"{value:.5f}" for value in (level, *light, 90 * (level / 255) ** 2.2)))
    (tmp_path / "photometer.csv").write_text("\n".join(table))
    (tmp_path / "markers.py").write_text("def mark(code, name, seconds):\n    assert (code, name) == (60, 'test')\n")
    command = [*DOCTOR, "--card", "--monitor", "lab", "--luminance", str(tmp_path / "photometer.csv")]
    command += ["--markers", str(tmp_path / "markers.py"), "--json"]
    environment = screen.environment
    running = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True, cwd=screen.folder)
    wide = round(0.0856 / (0.0254 / 96))
    deadline = time.monotonic() + 120
    # The frame's left side, white on black, is there once the card is asked for.
    while not (screen.pixels()[384, 512 - wide // 2 - 3 : 512 - wide // 2 + 4].max() > 100):
        assert time.monotonic() < deadline
        time.sleep(0.2)
    keep(screen, "doctor-card")
    wanted = round(0.0856 / 0.3 * 1024)
    tens, ones = divmod(abs(wanted - wide), 10)
    screen.keys(*["Down" if wanted < wide else "Up"] * tens, *["Left" if wanted < wide else "Right"] * ones, "Return")
    said, _ = running.communicate(timeout=120)
    assert running.returncode == 1
    checks = {one["name"]: one for one in json.loads(said)["checks"]}
    assert checks["triggers"]["well"]
    assert checks["size by a card"]["well"], checks["size by a card"]
    assert "screen 0.300 m wide" in checks["size by a card"]["measured"]
    assert "red 2.00, green 2.20, blue 2.40" in checks["gamma of the guns"]["measured"]
    assert not checks["gamma of the guns"]["well"]
    assert checks["gamma"]["measured"] == "2.20"
    assert checks["white"]["measured"] == "90.0 cd/m2"
    assert checks["fit of luminance"]["well"]
    assert "0.0% from grey" in checks["additivity"]["measured"]
    assert all(one["limit"] for name, one in checks.items() if name in ("frames", "clock", "triggers", "device pixels"))
    assert (tmp_path / "photometer-fit.png").read_bytes().startswith(b"\x89PNG")
    # A display that was made linear has gamma 1: measured, it counts.
    rows = [f"{level},{90 * level / 255:.4f}" for level in range(0, 256, 15)]
    (tmp_path / "linear.csv").write_text("\n".join(["level,grey", *rows]))
    program = (
        "import sys; from focalgradient.lab import screen; from focalgradient.luminance import read_luminance; "
        "screen.store_luminance('lab', read_luminance(sys.argv[1])); print(screen.calibration_of('lab').gamma)"
    )
    found = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "linear.csv")],
        env=environment,
        capture_output=True,
        text=True,
        cwd=screen.folder,
    )
    assert float(found.stdout.split()[-1]) == pytest.approx(1.0, abs=1e-3), found.stderr
