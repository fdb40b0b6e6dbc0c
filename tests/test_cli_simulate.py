"""`focalgradient simulate`: what it writes and says."""

import signal
import subprocess
import sys
import time
from functools import partial

import command_line
import pytest
from interrupts import interruptible

from focalgradient.dataset import validate
from focalgradient.display import Display
from focalgradient.observers import pictures
from focalgradient.stimuli import make_depth_rating

RATING = 'task = "depthrating"\nscenes = ["spheres-00"]\nrepetitions = 1\ncatch_trials = 0\npractice_trials = 0\n'
NECKER = 'task = "necker"\nrepetitions = 1\nstrengths_mm = [4.0]\ndirections = ["right"]\ntrial_s = 20.0\n'


run = partial(command_line.run, "simulate")


@pytest.fixture
def rating(tmp_path):
    (tmp_path / "rating.toml").write_text(RATING)
    return tmp_path / "rating.toml"


@pytest.fixture
def necker(tmp_path):
    (tmp_path / "necker.toml").write_text(NECKER + "catch_trials = 0\npractice_trials = 0\n")
    return tmp_path / "necker.toml"


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv(pictures.CACHE, str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.mark.slow
def test_both_experiments_go_into_one_data_set(tmp_path, rating, necker, cache, monkeypatch):
    def small(out, **how):
        return make_depth_rating(out, **(how | {"size": 128, "samples": 2, "display": Display(pixel_pitch=1e-3)}))

    monkeypatch.setattr(pictures, "make_depth_rating", small)
    out = tmp_path / "data"
    common = ("--observers", 2, "--seed", 4, "--out", out, "--workers", 1)
    result = run("depth-rating", *common, "--design", rating)
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines()[0] == "Simulated observers (default): 2."
    assert run("necker", *common, "--design", necker).exit_code == 0
    found = validate(out, cache / "pictures-1")
    assert not found.problems
    assert found.sessions == 4

    monkeypatch.setattr(pictures, "_encode", lambda job: pytest.fail("encoded again"))
    result = run("depth-rating", "--observers", 3, *common[2:], "--design", rating)
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines()[0] == "Simulated observers (default): 1; 2 existed already."


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is sent otherwise there")
@interruptible()
def test_ctrl_c_leaves_with_130_and_what_was_recorded(tmp_path, necker):
    out = tmp_path / "data"
    args = ["necker", "--observers", "2000", *f"--seed 1 --out {out} --design {necker} --workers 1".split()]
    command = [sys.executable, "-c", "from focalgradient.cli import main; main()", "simulate", *args]
    run = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 120
    while len(list(out.glob("sub-*/beh/*.tsv"))) < 3 and time.monotonic() < deadline:
        time.sleep(0.02)
    run.send_signal(signal.SIGINT)
    _, told = run.communicate(timeout=120)
    assert run.returncode == 130, told
    assert "Interrupted: recorded answers are kept" in told
    # At most one observer was cut off, and the same command goes on with that one.
    problems = validate(out).problems
    assert len(problems) <= 1
    assert all("resume the session" in problem for problem in problems)
    args[2] = str(len(list((out / "sourcedata").glob("sub-*"))))
    again = subprocess.run([*command[:3], "simulate", *args], capture_output=True, text=True, timeout=120, check=False)
    assert again.returncode == 0, again.stderr
    assert not validate(out).problems
