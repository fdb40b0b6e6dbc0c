"""Benchmarks' own scenes: they are made, and read as well as the benchmarks' documents say."""

import ast
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from focalgradient import recover_depth


@pytest.fixture(autouse=True)
def _found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "benchmarks")


def test_four_bands_read_gaussian_blur_better_than_one() -> None:
    found = import_module("realtime").band_errors(2.0, tries=1)
    assert found["1+2+4+8"][0] < 10 < found["8"][0]
    assert found["1+2+4+8"][1] > 0.95


def test_a_wall_of_gaussian_blur_is_read() -> None:
    trial = import_module("recover_depth").gaussian_wall(1.4, (120, 160))
    depth = recover_depth(trial.views, near=0.85, psf="gaussian")
    assert abs(np.median(depth.distance[depth.valid]) - 1.4) < 0.01


def test_halves_of_a_pupil_move_apart_by_the_distance_of_their_centres() -> None:
    """8 / (3 pi) radii for each dioptre; views alike do not tell the side of focus."""
    halves = import_module("pupil_halves")
    pairs = halves.pairs()
    expected = 60 * np.degrees(8 / (3 * np.pi) * halves.PUPIL / 2)
    assert halves.shift(*pairs["halves"]) == pytest.approx(expected, rel=0.03)
    whole, half = (halves.through(*pairs[name]) for name in ("whole pupil", "halves"))
    assert halves.divergence(whole) == pytest.approx(0, abs=1e-6)
    assert halves.divergence(half) > 50
    assert halves.deviation(half) < halves.deviation(whole)


def test_mutants_change_one_thing_each() -> None:
    """What computes is changed; texts, annotations, decorators, messages and checks of lengths are not."""
    changes = import_module("changes")
    source = '''
@kept(1)
def half(x: int = 3, far: Literal[4] = True) -> Literal[5]:
    """Half, as 6 / 2 is 3."""
    if not x < -0.5 and far:
        raise ValueError(f"{x + 7}")
    return [x / y for y in zip(x, strict=True)]
'''
    found = len(changes.sites(source)[1])
    changed = set()
    for index in range(found):
        tree, sites = changes.sites(source)
        before = ast.unparse(tree)
        sites[index][2]()
        changed.add(changes._difference(before, ast.unparse(tree))[1])
        assert sites[index][1] == ("half",)
    header = "def half(x: int={}, far: Literal[4]={}) -> Literal[5]:"
    assert changed == {
        header.format(4, True),
        header.format(3, False),
        "if not x < -0.5 or far:",
        "if not not x < -0.5 and far:",
        "if not x <= -0.5 and far:",
        "if not x < --0.5 and far:",
        "if not x < -0.75 and far:",
        "return [x * y for y in zip(x, strict=True)]",
    }
    assert found == len(changed)
