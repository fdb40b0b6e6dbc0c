"""Figures of depth maps: what they say, and what reaches the canvas."""

import re
import subprocess
import sys
from pathlib import Path

import cv2
import matplotlib
import numpy as np
import pytest
from matplotlib.text import Text

from focalgradient import DepthMap, InputError, Lens, View
from focalgradient.plotting import depth_figure
from focalgradient.stimuli import sheet

SHAPE = (60, 80)
ENDS = ("nearest", "farthest")
LONG = "IMG_20240102_123456_kitchen"


@pytest.mark.parametrize("apertures", [["f/5.6"], ["f/22", "f/11", "f/5.6"]])
def test_words_of_a_sheet_hide_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, apertures: list[str]) -> None:
    """Neither each other, nor a picture; nor do they leave the page."""
    pictures = [("pinhole", "nearest"), ("pinhole", "farthest"), *((n, e) for n in apertures for e in ENDS)]
    for aperture, end in pictures:
        cv2.imwrite(str(tmp_path / f"{aperture.replace('/', '')}-{end}.png"), np.full((4, 4, 3), 99, np.uint8))
    shown = [{"scene": LONG, "aperture": n, "fixation": e, "png": f"{n.replace('/', '')}-{e}.png"} for n, e in pictures]
    scene = {end: {"position_px": [1.0, 1.0], "distance_m": 12.34} for end in ENDS}
    note = "At most between conditions of a scene: amplitude in any octave 2.3 % from what blur predicts, and a shift."
    drawn: list = []
    monkeypatch.setattr(sheet, "as_file", lambda figure, kind: drawn.append(figure))
    sheet.sheet_png(tmp_path, {"pictures": shown, "scenes": {LONG: scene}}, note)
    (figure,) = drawn
    figure.draw_without_rendering()
    boxes = [text.get_window_extent() for text in texts(figure)] + [ax.get_window_extent() for ax in figure.axes]
    assert "IMG_2…itchen" in written(figure)
    for number, box in enumerate(boxes):
        assert figure.bbox.contains(box.x0, box.y0)
        assert figure.bbox.contains(box.x1, box.y1)
        assert not any(box.overlaps(other) for other in boxes[:number])


def views(*f_numbers: float, shape: tuple[int, int] = SHAPE) -> list[View]:
    image = np.random.default_rng(0).uniform(0.1, 1, shape)
    return [View(image, Lens(0.025, number, 0.85), 3e-4) for number in f_numbers]


def ramp(near: float = 1.0, far: float = 2.0, *, shape: tuple[int, int] = SHAPE, **changes: object) -> DepthMap:
    vergence = np.tile(np.linspace(1 / near, 1 / far, shape[1]), (shape[0], 1))
    everywhere = np.ones(shape, bool)
    parts = {"vergence": vergence, "vergence_sd": 0.01 * vergence, "valid": everywhere, "side_known": everywhere}
    return DepthMap(**(parts | changes))


def texts(figure) -> list[Text]:
    return [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]


def written(figure) -> str:
    return "\n".join(text.get_text() for text in texts(figure))


def panel(figure, title: str):
    (found,) = [ax for ax in figure.axes if ax.get_title(loc="left").startswith(title)]
    return found


def pixels(figure, ax) -> np.ndarray:
    """What the canvas shows inside `ax`, H x W x 3, its frame left out."""
    figure.canvas.draw()
    canvas = np.asarray(figure.canvas.buffer_rgba())[..., :3].astype(int)
    box = ax.get_window_extent()
    top, bottom = canvas.shape[0] - box.y1, canvas.shape[0] - box.y0
    return canvas[round(top) + 4 : round(bottom) - 4, round(box.x0) + 4 : round(box.x1) - 4]


def is_grey(colours: np.ndarray) -> np.ndarray:
    return np.ptp(colours, axis=-1) <= 4


def test_colour_bar_reads_in_metres():
    figure = depth_figure(views(16, 5.6), ramp(0.8, 5.0))
    (bar,) = [
        ax for ax in figure.findobj(matplotlib.axes.Axes) if ax.get_ylabel() == "distance from the entrance pupil (m)"
    ]
    read = [
        (float(label.get_text()), place) for label, place in zip(bar.get_yticklabels(), bar.get_yticks(), strict=True)
    ]
    assert len(read) >= 4
    assert all(1 / metres == pytest.approx(place) for metres, place in read)
    assert min(read)[0] < 1.0
    assert max(read)[0] > 2.5
    assert bar.yaxis_inverted()  # vergence falls upwards: far on top


def test_infinity_is_on_the_bar_and_nothing_behind_it():
    depth = ramp(vergence=np.tile(np.linspace(1.0, -0.2, SHAPE[1]), (SHAPE[0], 1)))
    figure = depth_figure(views(16, 5.6), depth)
    assert "∞" in written(figure)
    assert panel(figure, "Recovered").images[0].norm.vmin == 0


def test_rejected_pixels_show_hatched_grey_and_valid_ones_colour():
    valid = np.ones(SHAPE, bool)
    valid[:, :40] = False
    figure = depth_figure(views(16, 5.6), ramp(valid=valid), truth=1 / ramp().vergence)
    for title in ("Recovered", "Error", "Uncertainty"):
        shown = pixels(figure, panel(figure, title))
        half = shown.shape[1] // 2
        rejected, kept = shown[:, : half - 4], shown[:, half + 4 :]
        assert is_grey(rejected).all(), title
        assert rejected.max() > 230, title
        assert rejected.min() < 190, title  # the hatch: not one flat colour that a map might hold
        if title != "Error":  # here the error is 0, whose colour is nearly white
            assert not is_grey(kept).any(), title
    truth = pixels(figure, panel(figure, "True depth"))
    assert not is_grey(truth).any()
    assert "rejected" in written(figure)
    assert "50 % valid" in written(figure)


def test_one_scale_shows_near_bright_truth_and_error():
    shown = pixels(figure := depth_figure(views(16, 5.6), ramp(1.0, 2.0)), panel(figure, "Recovered"))
    luminance = shown.mean(axis=(0, 2))
    assert luminance[0] > 2 * luminance[-1]
    figure = depth_figure(views(16, 5.6), ramp(1.0, 1.5), truth=1 / ramp(1.0, 3.0).vergence)
    true, recovered = (panel(figure, title).images[0].norm for title in ("True", "Recovered"))
    assert (true.vmin, true.vmax) == (recovered.vmin, recovered.vmax)
    assert true.vmin == pytest.approx(1 / 3, rel=0.02)
    true = 1 / ramp().vergence
    figure = depth_figure(views(16, 5.6), ramp(vergence=1 / (1.02 * true)), truth=true)
    assert panel(figure, "Error").images[0].get_array().mean() == pytest.approx(2.0)
    assert "bias +2 %" in written(figure)


@pytest.mark.parametrize(
    ("known", "side", "said"),
    [
        (True, "estimated from the views", ""),
        (True, "assumed: nearer than focus", "side of focus assumed: nearer"),
        (False, "the views leave it open: all is taken to lie beyond focus", "side of focus assumed: beyond"),
    ],
)
def test_an_assumed_side_of_focus_is_stated(known, side, said):
    depth = ramp(side_known=np.full(SHAPE, known), details={"side": side})
    title = panel(depth_figure(views(16, 5.6), depth), "Recovered").get_title(loc="left")
    assert title.partition("\n")[2] == said


def test_the_title_of_uncertainty_states_that_of_pixels_and_of_the_frame():
    depth = ramp(
        common_errors=np.full((1, *SHAPE), 0.05),
        details={"side": "known", "blurred_alike_D": [0.65, 1.15], "searched_vergence_D": [0.1, 0.65]},
    )
    figure = depth_figure(views(16, 5.6), depth)
    assert written(figure).count("same blur nearer than the focus: 0.87 to 1.5 m") == 1
    uncertainty = panel(figure, "Uncertainty")
    title = uncertainty.get_title(loc="left")
    assert re.fullmatch(r"Uncertainty: median sd [\d.]+ %\nbetween pixels, [\d.]+ % in common", title)


@pytest.mark.parametrize(("count", "shape"), [(2, (60, 80)), (3, (90, 40)), (4, (20, 200)), (7, (90, 40))])
def test_legible_whatever_the_shape(count, shape):
    names = [f"a rather long name of a photograph {index}.png" for index in range(count)]
    depth = ramp(shape=shape, side_known=np.zeros(shape, bool))
    figure = depth_figure(views(*range(1, count + 1), shape=shape), depth, names=names, truth=1 / depth.vergence)
    assert figure.get_figwidth() * 25.4 == pytest.approx(180)
    assert min(text.get_fontsize() for text in texts(figure)) >= 8
    assert (f"4 of {count} views" in written(figure)) == (count > 4)


@pytest.mark.parametrize("truth", [None, np.full(SHAPE, 1.5)])
def test_a_completed_map_is_drawn_whole_below_the_measured_one(truth):
    evidence = np.full(SHAPE, 2, np.uint8)
    evidence[:, : SHAPE[1] // 2] = 1
    evidence[:, : SHAPE[1] // 4] = 0
    figure = depth_figure(views(16, 5.6), ramp(valid=evidence == 2, evidence=evidence), truth=truth)
    completed = panel(figure, "Completed")
    assert completed.get_title(loc="left") == "Completed depth: 50 % measured,\n25 % near evidence, 25 % guessed"
    assert not is_grey(pixels(figure, completed)).any()
    assert is_grey(pixels(figure, panel(figure, "Recovered"))).any()


@pytest.mark.parametrize(
    ("options", "message"),
    [({"names": ["one"]}, "1 entries for 2 views"), ({"truth": np.ones((3, 4))}, r"shape \(3, 4\)")],
)
def test_what_does_not_fit_is_refused(options, message):
    with pytest.raises(InputError, match=message):
        depth_figure(views(16, 5.6), ramp(), **options)


@pytest.mark.slow
def test_a_large_map_is_drawn_by_every_other_pixel(monkeypatch: pytest.MonkeyPatch) -> None:
    """As it is drawn whole, but with a quarter of the memory."""
    rows, columns = np.mgrid[: SHAPE[0], : SHAPE[1]] / 100
    vergence = 1.0 + rows + columns
    depth = DepthMap(vergence, 0.01 * vergence, columns < 0.6, columns < 9)
    views = [View(vergence.astype(np.float32), Lens(0.025, n, 1.0), 3e-4) for n in (16, 4)]
    titles, sizes = [], []
    for most in (2000, 40):
        monkeypatch.setattr("focalgradient.plotting.maps._MOST_PIXELS", most)
        figure = depth_figure(views, depth, truth=1 / vergence)
        titles.append([ax.get_title(loc="left") for ax in figure.axes])
        sizes.append(figure.axes[0].images[0].get_array().shape)
    assert titles[0] == titles[1]
    assert sizes == [SHAPE, (SHAPE[0] // 2, SHAPE[1] // 2)]


def test_no_display_and_no_global_state():
    before = dict(matplotlib.rcParams)
    depth_figure(views(16, 5.6), ramp())
    assert dict(matplotlib.rcParams) == before
    code = "import sys, focalgradient.plotting; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_the_meaning_of_grey_is_stated():
    beyond = np.zeros(SHAPE, np.int8)
    beyond[:3] = -1
    alike = {"side": "known", "blurred_alike_D": [0.65, 1.15], "searched_vergence_D": [0.1, 0.65]}
    depth = ramp(beyond=beyond, common_errors=np.full((1, *SHAPE), 0.05), details=alike)
    figure = depth_figure(views(16, 5.6), depth, names=["a.png", "b.png"])
    assert "grey: farther than the search, or nearer than 0.87 m" in " ".join(written(figure).split())
