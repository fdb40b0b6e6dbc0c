"""Focus by gaze: what the series is taken for, and a real window with the mouse and with ioHub's simulated tracker."""

from __future__ import annotations

import csv
import gzip
import json
import time
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from headless import Headless, Running, headless, keep, psychopy_here
from numpy.typing import NDArray

from focalgradient.cli import main
from focalgradient.dataset import bids_problems, repair, validate
from focalgradient.errors import InputError
from focalgradient.live import Focusing, read_series

WIDTH, HEIGHT = 240, 160


@pytest.fixture(scope="module")
def series(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three cards side by side at 0.5, 1 and 4 m, in focus one after the other."""
    folder = tmp_path_factory.mktemp("series")
    light = np.random.default_rng(1).uniform(0.1, 0.9, (HEIGHT, WIDTH, 3)).astype(np.float32)
    np.save(folder / "picture.npy", light)
    np.save(folder / "depth.npy", np.repeat([0.5, 1.0, 4.0], WIDTH // 3) * np.ones((HEIGHT, 1)))
    given = ["blur", *(str(folder / name) for name in ("picture.npy", "depth.npy")), "--out", str(folder / "series")]
    given += ["--pupil", "4", "--field", "8", "--focus", "1", "--focus", "0.5", "--focus", "4"]
    assert CliRunner().invoke(main, given).exit_code == 0
    return folder / "series"


def test_the_depth_tells_which_focus_a_place_wants(series: Path) -> None:
    found = read_series(series)
    assert found.vergences == (0.25, 1.0, 2.0)
    wanted = [found.nearest(found.vergence_at(x, 80, 3) or 0) for x in (40, 120, 200)]
    assert [found.vergences[number] for number in wanted] == [2.0, 1.0, 0.25]
    assert found.vergence_at(-1, 80) is None
    assert found.vergence_at(WIDTH, 80) is None


def test_between_two_foci_light_is_mixed(series: Path) -> None:
    found = read_series(series)
    for number, vergence in enumerate(found.vergences):
        assert (found.at(vergence) == found.planes[number]).all()
    mean = (found.planes[1].astype(float) + found.planes[2]) / 2
    np.testing.assert_allclose(found.at(1.5), mean, atol=1e-6)
    assert np.isnan(found.error).all()  # not measured


def test_an_eye_takes_its_time_and_another_transition_none() -> None:
    eye, immediate = Focusing([0.0, 2.0], "eye"), Focusing([0.0, 2.0], "immediate")
    assert eye.look(1)
    assert not eye.look(1)
    for _ in range(18):  # 0.3 s at 60 Hz
        vergence = eye.step(1 / 60)
    assert vergence == pytest.approx(2 * (1 - np.exp(-1)))
    immediate.look(1)
    assert immediate.step(1e-9) == 2.0


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"focus_m": [0.0, 1.0]}, "is not a summary"),
        ({"focus_m": [-1.0, 1.0]}, "is not a summary"),
        ({"focus_m": [1.0, 1.0]}, "two or more foci"),
        ({"focus_m": [1.0, 4.0], "white": 0.0}, "is not a summary"),
        ({"focus_m": [1.0, 2.0]}, "blurred-2.0m.npy"),  # is missing
        ({"focus_m": [1.0, 0.5]}, "inconsistent with"),  # holds NaN
        ({"focus_m": [1.0, 4.0]}, "inconsistent with"),  # has four colours
    ],
)
def test_a_damaged_series_is_refused(tmp_path: Path, settings: dict[str, object], said: str) -> None:
    (tmp_path / "summary.json").write_text(json.dumps({"settings": settings, "pictures": [{}]}))
    np.save(tmp_path / "distance.npy", np.ones((4, 6)))
    np.save(tmp_path / "blurred-1.0m.npy", np.ones((4, 6, 3), np.float32))
    np.save(tmp_path / "blurred-0.5m.npy", np.full((4, 6, 3), np.nan, np.float32))
    np.save(tmp_path / "blurred-4.0m.npy", np.ones((4, 6, 4), np.float32))
    with pytest.raises(InputError, match=said):
        read_series(tmp_path)


def shown(screen: Headless) -> NDArray[np.uint8]:
    """The middle of the screen, as large as the pictures."""
    found = screen.pixels()
    top, left = (found.shape[0] - HEIGHT) // 2, (found.shape[1] - WIDTH) // 2
    return found[top : top + HEIGHT, left : left + WIDTH]


def until_shown(screen: Headless, picture: NDArray[np.uint8]) -> None:
    end = time.monotonic() + 120
    while np.abs(shown(screen).astype(int) - picture).max() > 1:  # but for rounding
        assert time.monotonic() < end, "the picture never came"
        time.sleep(0.01)


@pytest.mark.slow
@psychopy_here
@pytest.mark.parametrize("gaze", ["mouse", pytest.param("tracker", marks=pytest.mark.slow)])
def test_what_is_looked_at_comes_into_focus(series: Path, tmp_path: Path, gaze: str) -> None:
    found = read_series(series)
    expected = [found.encoded(vergence) for vergence in found.vergences]
    data = tmp_path / "data"
    with headless(tmp_path / "x") as screen:
        middle = (screen.pixels().shape[1] // 2, screen.pixels().shape[0] // 2)

        def look(card: int) -> None:
            screen.xdotool("mousemove", str(middle[0] + 80 * (card - 1)), str(middle[1]))

        look(1)
        options = ["--series", series, "--gaze", gaze, "--data", data, "--participant", "01", "--seconds", "600"]
        running = Running(screen, "gaze-focus", *options, "--transition", "immediate", "--language", "de")
        for event in running.events():
            if event == "ready":
                time.sleep(0.2)
                keep(screen, f"gaze-focus-{gaze}")
                screen.keys("space")
            elif event == "picture":
                break
        for card, focus in ((0, 2), (2, 0), (1, 1), (0, 2)):  # cards from near to far, foci from far to near
            look(card)
            until_shown(screen, expected[focus])
        screen.keys("Escape")
        for event in running.events():
            if event == "quit?":
                time.sleep(0.2)
                screen.keys("j")
        assert running.end() == 1, running.errors
    name = "sub-01/beh/sub-01_task-gazefocus_events"
    with (data / f"{name}.tsv").open() as file:
        rows = list(csv.DictReader(file, delimiter="\t"))
    foci = [float(row["focus_dioptre"]) for row in rows]
    assert foci[-4:] == [2.0, 0.25, 1.0, 2.0]
    told = json.loads((data / f"{name}.json").read_text())
    latencies = np.array([float(row["latency_ms"]) for row in rows[-4:]])
    frames = np.array([float(row["latency_frames"]) for row in rows[-4:]])
    print(f"{gaze}: {latencies} ms, {frames} frames; {told['Latency']}")
    assert (latencies > 0).all()
    assert np.allclose(frames, latencies / 1e3 * 60, rtol=0.2)
    assert told["Latency"]["median"]["ms"] > 0
    assert told["Settings"]["gaze"] == {"mouse": "mouse", "tracker": "eyetracker.hw.mouse.EyeTracker"}[gaze]
    journal = [json.loads(line) for line in (data / "sourcedata" / f"{name}.jsonl").read_text().splitlines()]
    kept = [event["focus_dioptre"] for event in journal if event.get("kind") == "focus" and "latency_ms" in event]
    assert kept == pytest.approx(foci)
    assert sum(len(event["samples"]) for event in journal if event.get("kind") == "gaze") >= len(rows)
    assert bids_problems(data) == []
    validate(data)  # is not in its way


@psychopy_here
@pytest.mark.slow
def test_two_sessions_at_one_time_keep_their_own_gaze(series: Path, tmp_path: Path) -> None:
    places = (460, 560)  # across the screen, px
    with ExitStack() as screens:
        running = []
        for number in range(len(places)):
            screen = screens.enter_context(headless(tmp_path / f"x{number}"))
            options = ["--series", series, "--gaze", "tracker", "--data", tmp_path / f"data{number}"]
            running.append(Running(screen, "gaze-focus", *options, "--participant", "01", "--seconds", "8"))
        for one in running:  # both trackers run before either session begins
            while next(one.events()) != "ready":
                pass
        for place, one in zip(places, running, strict=True):
            one.screen.xdotool("mousemove", str(place), "300")
            one.screen.keys("space")
        for one in running:
            for event in one.events():
                if event in ("thanks", "debriefing"):
                    one.screen.keys("space")
            assert one.end() == 0, one.errors
    for number, place in enumerate(places):
        (file,) = (tmp_path / f"data{number}").glob("sub-01/beh/*_physio.tsv.gz")
        horizontal = np.array(
            [line.split("\t")[1] for line in gzip.decompress(file.read_bytes()).decode().splitlines()]
        )
        found = horizontal[horizontal != "n/a"].astype(float)
        assert len(found) > 100
        assert set(found[-100:]) == {place}


@pytest.mark.slow
@psychopy_here
def test_a_kill_leaves_samples_that_repair_brings_out(series: Path, tmp_path: Path) -> None:
    data = tmp_path / "data"
    with headless(tmp_path / "x") as screen:
        options = ["--series", series, "--data", data, "--participant", "01", "--seconds", "60"]
        running = Running(screen, "gaze-focus", *options)
        for event in running.events():
            if event == "ready":
                time.sleep(0.2)
                screen.keys("space")
            elif event == "picture":
                break
        time.sleep(4)
        running.process.kill()
        running.end()
    assert any("use 'focalgradient repair'" in problem for problem in validate(data).problems)
    (made,) = repair(data)
    assert made.problem == ""
    assert validate(data).problems == ()
    assert bids_problems(data) == []
    samples = gzip.decompress(next(data.glob("sub-01/beh/*_physio.tsv.gz")).read_bytes()).decode().splitlines()
    assert len(samples) >= 60
    assert all(len(line.split("\t")) == 6 for line in samples)
