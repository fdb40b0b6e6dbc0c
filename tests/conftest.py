"""What several files of tests here begin with; a file's own fixture of the same name goes before."""

import sys
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, settings
from two_views import TOML, picture, write

sys.path.insert(0, str(Path(__file__).parents[1] / "analysis"))  # the figures' scripts import one another by name

# No test asserts speed: a slow machine must not fail one.
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")


@pytest.hookimpl(tryfirst=True)  # before `-m` chooses
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark as slow the cases of a test beyond those that `fast_cases` grants it, evenly chosen."""
    for _, group in groupby(items, key=lambda item: item.nodeid.split("[")[0]):
        cases = [item for item in group if item.get_closest_marker("slow") is None]
        granted = cases[0].get_closest_marker("fast_cases") if cases else None
        if granted is not None:
            fast = set(np.linspace(0, len(cases) - 1, granted.args[0]).round().astype(int).tolist())
            for number, item in enumerate(cases):
                if number not in fast:
                    item.add_marker(pytest.mark.slow)


class Drawn:
    """Figures drawn since the last test; matplotlib is not imported for tests that do not draw."""

    def __init__(self) -> None:
        self.figures: list = []
        self.watched = False

    def watch(self) -> None:
        """Note every new figure, once matplotlib has been imported."""
        if self.watched or "matplotlib.figure" not in sys.modules:
            return
        figure = sys.modules["matplotlib.figure"].Figure
        begin = figure.__init__

        def noted(made: object, *given: object, **options: object) -> None:
            begin(made, *given, **options)
            self.figures.append(made)

        figure.__init__, self.watched = noted, True


DRAWN = Drawn()


@pytest.fixture(autouse=True)
def whole_figures(request: pytest.FixtureRequest) -> Iterator[None]:
    """Fail where a figure has content that is cut off or covered (`analysis/figure_faults.py`)."""
    DRAWN.watch()
    yield
    figures, DRAWN.figures = DRAWN.figures, []
    if figures and request.node.get_closest_marker("figure_with_faults") is None:
        from figure_faults import check_figure

        from focalgradient.plotting import style

        for figure in figures:
            with style():
                check_figure(figure)


@pytest.fixture
def unrendered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Write no pixels of a report's figures, which take most of its time; each figure is checked as it is drawn."""
    monkeypatch.setattr("focalgradient.report.parts.as_files", lambda figure: {"png": b"\x89PNG", "pdf": b"%PDF"})


@pytest.fixture(scope="module")
def pictures() -> dict[str, np.ndarray]:
    return {"a.png": picture(16), "b.png": picture(5.6)}


@pytest.fixture
def folder(tmp_path, monkeypatch, pictures):
    """A folder, made the current one, with two pictures and the settings file that names them."""
    for name, pixels in pictures.items():
        write(tmp_path / name, pixels)
    (tmp_path / "views.toml").write_text(TOML)
    monkeypatch.chdir(tmp_path)
    return tmp_path
