"""The check of figures finds each way of cutting and covering content, and nothing in a figure that is whole.

`tests/conftest.py` runs the check over every figure that a test draws.
"""

import runpy
from pathlib import Path

import numpy as np
import pytest
from figure_faults import CutContentError, check_figure, figure_faults
from matplotlib import pyplot

from focalgradient.plotting import new_figure, style


def whole():
    """Return a figure of a curve with a label and a legend, without faults."""
    figure = new_figure(80, 60, layout="constrained")
    ax = figure.add_subplot()
    ax.plot([0, 1, 2], [0, 1, 2], label="rising")
    ax.axhline(-1, linewidth=0.5)
    ax.set_ylim(-2, 8)
    ax.set(xlabel="level (D)", ylabel="answer")
    ax.legend(loc="upper left")
    return figure, ax


FAULTS = {
    "leaves the figure": lambda ax: ax.set_xlabel("a label of which one cannot tell where it ends " * 4),
    "Line2D 'rising' leaves the axes 'answer'": lambda ax: ax.set_ylim(-2, 1.5),
    "LineCollection leaves the axes": lambda ax: [ax.errorbar([1], [1], [[1], [5]]), ax.set_ylim(-2, 5.1)],
    "PathCollection leaves the axes": lambda ax: [ax.scatter([1], [9]), ax.set_ylim(-2, 8)],
    "'near in focus' and 'far in focus' touch": lambda ax: [
        ax.text(0.5, 4, "near in focus"),
        ax.text(0.6, 4, "far in focus"),
    ],
    "'near in focus' and 'distant in focus' touch": lambda ax: [
        ax.text(0.5, 3, "near in focus", rotation=45),
        ax.text(0.5, 3, "distant in focus", rotation=-30),
    ],
    "a legend covers Line2D": lambda ax: ax.plot([0, 2], [7, 7.2]),
    "'another' and 'rising' look alike": lambda ax: [
        ax.plot([0, 1], [4, 4], color="C0", label="another"),
        ax.legend(loc="upper left"),
    ],
    "has its unit alone on a line": lambda ax: ax.set_ylabel("distance from the pupil\n(m)"),
    "leave the figure": lambda ax: ax.figure.add_axes((0.9, 0.1, 0.2, 0.1)),
}
"""Ways of spoiling a whole figure, by the fault that is found."""


@pytest.mark.figure_with_faults
@pytest.mark.parametrize("fault", FAULTS)
def test_each_fault_is_found(fault):
    with style():
        figure, ax = whole()
        FAULTS[fault](ax)
        with pytest.raises(CutContentError, match="drawn has content") as caught:
            check_figure(figure, "drawn")
    assert fault in str(caught.value)


def test_a_whole_figure_has_none():
    with style():
        figure, ax = whole()
        for x in (0.5, 0.7, 0.9):  # turned labels side by side, whose upright boxes overlap
            ax.text(x, 3, "pinhole", rotation=45)
        ax.text(0, 9, "far above", visible=False)
        ax.plot([0, 2], [-0.2, 50], gid="clipped", scaley=False)
        assert figure_faults(figure) == []


@pytest.mark.figure_with_faults
def test_a_curve_of_two_panels_with_one_axis_is_found():
    """Limits set by the last panel cut the first."""
    with style():
        figure = new_figure(120, 60, layout="constrained")
        left, right = figure.subplots(1, 2, sharey=True)
        left.plot([0, 1], [1, 1.6])
        right.plot([0, 1], [1, 1.1])
        right.set_ylim(0.9, 1.2)
        assert figure_faults(figure) == ["Line2D leaves the axes 'without a name'"]


GALLERY = Path(__file__).parents[2] / "docs" / "examples"
QUICK = (
    "blur_of_a_lens",
    "how_depth_is_found",
    "measured_eye",
    "necker_cube",
    "own_ratings",
    "power",
    "two_bands_of_an_eye",
)
"""Programs of the gallery that take about a second; `make docs` checks the others."""


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK)
def test_figures_of_the_gallery_are_whole(name, monkeypatch):
    monkeypatch.setattr(pyplot, "show", lambda: None)
    monkeypatch.chdir(GALLERY)
    runpy.run_path(str(GALLERY / f"plot_{name}.py"))
    figures = [pyplot.figure(number) for number in pyplot.get_fignums()]
    assert figures
    for figure in figures:
        check_figure(figure, name)
    if name == "necker_cube":  # nor is the cube cropped by its picture
        for ax in figures[0].axes:
            frame = np.asarray(ax.images[0].get_array())
            assert max(frame[0].max(), frame[-1].max(), frame[:, 0].max(), frame[:, -1].max()) < 0.02
    pyplot.close("all")
