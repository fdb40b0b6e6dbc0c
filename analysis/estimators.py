"""Comparison of all estimators with the information limit, by blur, noise and texture."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray
from report import Progress, Shown, alone

from focalgradient import DepthMap, FocalGradientWarning, Lens, View, recover_depth
from focalgradient.depth.limits import edge_bound, texture_bound
from focalgradient.depth.ratio import focal_disparity
from focalgradient.depth.settings import MethodName
from focalgradient.photographs import srgb_to_linear
from focalgradient.plotting import GREY, new_figure, style
from focalgradient.psf import DISC_K, PsfName, pixel_transfer, transfer

FloatArray = NDArray[np.float64]

FOCUS = 0.85  # m
WIDE, NARROW = (Lens(focal_length=0.025, f_number=number, focus_distance=FOCUS) for number in (5.6, 11.2))
PIXEL = 3.2e-4  # rad
SIDE = 256  # pixels of a view
AROUND = 64  # margin of the wall beyond the view in pixels, for blur from outside
MARGIN = 32  # pixels at the border of the frame that are not scored, where windows are truncated
WINDOW = 8.0  # pixels
CONTRAST = 0.2
STEP = 0.5  # contrast of the painted squares
LENGTH = 16.0  # length of edge per estimate, in pixels
STACK = 30  # number of focus settings of autofocus
BLURS = (1.0, 2.0, 3.0, 4.0)  # px, standard deviation in the large-aperture view
NOISES = (0.002, 0.01, 0.03)  # relative to the mean radiance
FEW_BLURS, FEW_NOISES = (1.0, 2.0, 4.0), (0.002, 0.03)  # without `full`


@dataclass(frozen=True, slots=True)
class Estimator:
    """Depth estimator, with the views that it is given."""

    label: str
    method: MethodName
    lenses: Callable[[], list[Lens]]
    textures: tuple[str, ...]


PAIR = ("natural (1/f)", "dead leaves", "photograph")

ESTIMATORS = (
    Estimator("equalise (default)", "equalise", lambda: [NARROW, WIDE], PAIR),
    Estimator("spectra", "spectra", lambda: [NARROW, WIDE], PAIR),
    Estimator("ratio (real time)", "ratio", lambda: [NARROW, WIDE], PAIR),
    Estimator(f"autofocus, {STACK} images", "autofocus", lambda: stack(), PAIR[:1]),
    Estimator("edges, one image", "edges", lambda: [WIDE], ("squares",)),
)


def stack() -> list[Lens]:
    """Return focus settings evenly spaced in vergence, from infinity to nearer than the nearest wall."""
    return [Lens(0.025, 5.6, 1 / level if level else np.inf) for level in np.linspace(0, 1.4, STACK)]


def vergence(sigma: float) -> float:
    """Return the vergence beyond focus at which the large-aperture view has a blur SD of `sigma` pixels."""
    return WIDE.focus_vergence - sigma / DISC_K * PIXEL / (WIDE.aperture_diameter / 2)


@cache
def wall(texture: str, seed: int) -> FloatArray:
    """Return a sharp wall with mean 1, `AROUND` pixels wider than a view on every side."""
    side = SIDE + 2 * AROUND
    random = np.random.default_rng([seed, 7])
    if texture == "squares":
        return _squares(side, random)
    if texture == "natural (1/f)":
        frequency = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.fftfreq(side))
        white = np.fft.fft2(random.standard_normal((side, side)))
        field = np.fft.ifft2(white / np.where(frequency > 0, frequency, np.inf)).real
    elif texture == "dead leaves":
        field = _dead_leaves(side, random)
    else:
        field = _photograph(side, random)
    spectrum = np.fft.fft2(field) * pixel_transfer(np.fft.fftfreq(side)[:, None], np.fft.fftfreq(side))
    field = np.fft.ifft2(spectrum).real
    inside = field[AROUND:-AROUND, AROUND:-AROUND]
    return np.asarray(1 + CONTRAST * (field - inside.mean()) / inside.std())


def _dead_leaves(side: int, random: np.random.Generator) -> FloatArray:
    """Return opaque grey discs that occlude each other; radii with density r^-3 from 2 pixels to side / 4."""
    field = np.full((side, side), np.nan)
    row, column = np.mgrid[:side, :side]
    while np.isnan(field).any():  # from front to back
        share = random.uniform()
        radius = (2.0**-2 - share * (2.0**-2 - (side / 4) ** -2)) ** -0.5
        y, x = random.uniform(-radius, side + radius, 2)
        grey = random.uniform()
        box = (slice(max(0, int(y - radius)), int(y + radius) + 2), slice(max(0, int(x - radius)), int(x + radius) + 2))
        part = field[box]
        leaf = np.isnan(part) & (np.hypot(row[box] - y, column[box] - x) <= radius)
        part[leaf] = grey
    return field


def _photograph(side: int, random: np.random.Generator) -> FloatArray:
    """Return a region of a photograph as linear radiance."""
    # deferred import: needed only here
    from skimage.data import stereo_motorcycle

    encoded = stereo_motorcycle()[0].mean(axis=2) / 255  # type: ignore[no-untyped-call]
    picture = srgb_to_linear(encoded)
    top, left = (random.integers(n - side + 1) for n in picture.shape)
    return np.asarray(picture[top : top + side, left : left + side])


def _squares(side: int, random: np.random.Generator) -> FloatArray:
    """Return dark tilted squares on a bright sheet, antialiased by 8 x 8 points per pixel."""
    row, column = (np.mgrid[: 8 * side, : 8 * side] + 0.5) / 8
    sheet = np.full(row.shape, 1 + STEP / 2)
    for y in np.arange(48, side, 96):
        for x in np.arange(48, side, 96):
            turn = random.uniform(0, np.pi / 2)
            u = (column - x) * np.cos(turn) + (row - y) * np.sin(turn)
            v = (row - y) * np.cos(turn) - (column - x) * np.sin(turn)
            sheet[np.maximum(np.abs(u), np.abs(v)) < 27] = 1 - STEP / 2
    return sheet.reshape(side, 8, side, 8).mean(axis=(1, 3))


def views_of(
    texture: str, lenses: Sequence[Lens], level: float, noise: float, seed: int, psf: PsfName = "gaussian"
) -> list[View]:
    """Return views of a wall at vergence `level`, blurred by the estimators' own model, with independent noise."""
    sharp = wall(texture, seed)
    side = len(sharp)
    spectrum = np.fft.fft2(sharp)
    frequency = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.fftfreq(side))
    views = []
    for number, lens in enumerate(lenses):
        blurred = np.fft.ifft2(spectrum * transfer(frequency, lens.blur_radius(1 / level) / PIXEL, psf)).real
        image = blurred[AROUND:-AROUND, AROUND:-AROUND]
        image = image + noise * np.random.default_rng([seed, number]).standard_normal(image.shape)
        views.append(View(image.astype(np.float32), lens, PIXEL))
    return views


def measure(
    *,
    seeds: int = 1,
    estimators: Sequence[Estimator] = ESTIMATORS,
    blurs: Sequence[float] = BLURS,
    noises: Sequence[float] = NOISES,
    psf: PsfName = "gaussian",
    progress: Progress | None = None,
) -> list[dict[str, float | str]]:
    """Score every estimator on every wall.

    Returns
    -------
    list of dict
        One row per estimator, texture, blur and noise. ``bias_percent`` and ``rms_percent`` are errors of the blur
        (proportional to defocus) over the valid pixels more than `MARGIN` from the border; ``multiple_of_bound`` is the
        RMS error divided by the bound for the same pixels, in windows of `WINDOW`; ``coverage_percent`` is the fraction
        within two stated SDs; ``valid_percent`` the fraction of all pixels that is not rejected.
    """
    cases = [(e, t, s, n) for e in estimators for t in e.textures for s in blurs for n in noises]
    rows: list[dict[str, float | str]] = []
    for done, (estimator, texture, sigma, noise) in enumerate(cases):
        level = vergence(sigma)
        lenses = estimator.lenses()
        error, within, valid, least = [], [], [], []
        for seed in range(seeds):
            views = views_of(texture, lenses, level, noise, seed, psf)
            depth = _recover(views, estimator.method, psf)
            inside = np.zeros(depth.shape, np.bool_)
            inside[MARGIN:-MARGIN, MARGIN:-MARGIN] = True
            kept = depth.valid & inside
            error.append(depth.vergence[kept].astype(float) - level)
            within.append(np.abs(error[-1]) <= 2 * depth.vergence_sd[kept])
            valid.append(float(kept.sum() / inside.sum()))
            least.append(bound(estimator, texture, sigma, noise, seed, psf)[kept])
        errors = np.concatenate(error)
        defocus = WIDE.focus_vergence - level
        some = errors.size > 0
        rms = float(np.sqrt(np.mean(errors**2))) if some else np.nan
        rows.append(
            {
                "estimator": estimator.label,
                "texture": texture,
                "sigma_px": sigma,
                "noise_percent": 100 * noise,
                "bias_percent": 100 * float(errors.mean()) / defocus if some else np.nan,
                "rms_percent": 100 * rms / defocus,
                "multiple_of_bound": rms / float(np.sqrt(np.mean(np.concatenate(least) ** 2))) if some else np.nan,
                "coverage_percent": 100 * float(np.concatenate(within).mean()) if some else np.nan,
                "valid_percent": 100 * float(np.mean(valid)),
            }
        )
        if progress is not None:
            progress((done + 1) / len(cases))
    return rows


@cache
def bound(estimator: Estimator, texture: str, sigma: float, noise: float, seed: int, psf: PsfName) -> FloatArray:
    """Return the bound on the SD of vergence, in dioptres, at each pixel of the view."""
    level = vergence(sigma)
    if estimator.method == "edges":
        relative = float(edge_bound(sigma, noise=noise, contrast=STEP, length=LENGTH))
        return np.full((SIDE, SIDE), relative * (WIDE.focus_vergence - level))
    everywhere = texture_bound(
        wall(texture, seed), estimator.lenses(), level, PIXEL, noise=noise, window=WINDOW, psf=psf
    )
    return everywhere[AROUND:-AROUND, AROUND:-AROUND]


def _recover(views: list[View], method: MethodName, psf: PsfName) -> DepthMap:
    near = None if method == "autofocus" else FOCUS
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FocalGradientWarning)
        return recover_depth(views, method=method, near=near, psf=psf, window=WINDOW)


def milliseconds(estimator: Estimator) -> float:
    """Return the milliseconds for the depth of one frame of `SIDE` x `SIDE` pixels, the fastest of several runs."""
    views = views_of(estimator.textures[0], estimator.lenses(), vergence(2.0), 0.01, 0)
    return _fastest(lambda: _recover(views, estimator.method, "gaussian"))


def disparity_milliseconds() -> float:
    """Return the milliseconds for the focal disparity of such a frame (section III.C, without distances)."""
    small, large = (view.image for view in views_of(PAIR[0], [NARROW, WIDE], vergence(2.0), 0.01, 0))
    return _fastest(lambda: focal_disparity(small, large, noise=0.01, window=WINDOW))


def _fastest(work: Callable[[], object], repeat: int = 3) -> float:
    """Return the milliseconds of the fastest of `repeat` runs, after one that compiles."""
    seconds = []
    for _ in range(repeat + 1):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return 1e3 * min(seconds[1:])


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    """Make the figure; `full` uses all blurs and noises and four walls of each kind, instead of a subset with one."""
    if full:
        rows = measure(seeds=4, progress=progress)
    else:
        rows = measure(blurs=FEW_BLURS, noises=FEW_NOISES, progress=progress)
    speed = {estimator.label: milliseconds(estimator) for estimator in ESTIMATORS}
    alone_ms = disparity_milliseconds()

    def worst(estimator: Estimator, name: str) -> float:
        values = [abs(float(row[name])) for row in rows if row["estimator"] == estimator.label]
        return max((value for value in values if np.isfinite(value)), default=float("nan"))

    return Shown(
        title="All estimators against the information limit",
        caption=(
            "Flat walls seen through f/11.2 and f/5.6 (autofocus: through f/5.6 at thirty settings of focus; edges: "
            "one view at f/5.6), with Gaussian blur of one to four pixels, and weak to strong noise. Top: root mean "
            "square error of depth over the Cramér-Rao bound at the same pixels, for a Gaussian window of "
            f"{WINDOW:g} pixels; for edges, for {LENGTH:g} pixels of edge. Below it: bias, as a share of the blur; and "
            "the share of estimates that lie within two of their stated standard deviations (95 % is right). Rejected "
            f"pixels and those within {MARGIN} pixels of the border are left out; a dash means that all were rejected. "
            "Autofocus is shown on one texture only, as each of its cases takes thirty images; edges are measured "
            "on printed squares only, and the others, which need texture everywhere, are not tried on these.",
            f"Times are of one frame of {SIDE} × {SIDE} pixels, from images to distances with their uncertainty. The "
            f"focal disparity alone, the paper’s real-time form, takes {alone_ms:.2g} ms.",
            "A multiple can be below 1: an estimator that enlarges its window where the surface is flat, or averages "
            "along a contour, uses more pixels than the bound assumes. The default's window grows up to 1.7-fold.",
        ),
        figure=_draw(rows, speed, alone_ms),
        summary={
            "worst_multiple_of_bound": {one.label: worst(one, "multiple_of_bound") for one in ESTIMATORS},
            "largest_bias_percent": {one.label: worst(one, "bias_percent") for one in ESTIMATORS},
            f"time_for_{SIDE}_x_{SIDE}_pixels_ms": speed,
            f"focal_disparity_of_{SIDE}_x_{SIDE}_pixels_ms": alone_ms,
        },
        plotted={"rows": rows},
    )


SHOWN = (  # quantity, title, format of a cell, colours, their limits
    ("multiple_of_bound", "Error, in multiples of the bound", "{:.2f}", "viridis_r", LogNorm(0.5, 20, clip=True)),
    ("bias_percent", "Bias (% of the blur)", "{:+.1f}", "PuOr", Normalize(-10, 10, clip=True)),
    ("coverage_percent", "Estimates within 2 stated sd (%)", "{:.0f}", "cividis", Normalize(0, 100, clip=True)),
)


def _draw(rows: Sequence[dict[str, float | str]], speed: dict[str, float], alone_ms: float) -> Figure:
    lines = [(texture, e.label) for texture in (*PAIR, "squares") for e in ESTIMATORS if texture in e.textures]
    noises, blurs = (sorted({float(row[name]) for row in rows}) for name in ("noise_percent", "sigma_px"))
    columns = [(noise, sigma) for noise in noises for sigma in blurs]
    cell = {
        (str(row["texture"]), str(row["estimator"]), float(row["noise_percent"]), float(row["sigma_px"])): row
        for row in rows
    }
    with style():
        figure = new_figure(180, 222)
        for panel, (name, title, form, colours, norm) in enumerate(SHOWN):
            ax = figure.add_axes((0.30, 0.705 - 0.3225 * panel, 0.69, 0.25))
            values = np.array([[float(cell[*line, *column][name]) for column in columns] for line in lines])
            ax.imshow(values, aspect="auto", cmap=colours, norm=norm)
            for (i, j), value in np.ndenumerate(values):
                red, green, blue, _ = colormaps[colours](norm(value)) if np.isfinite(value) else (1, 1, 1, 1)
                ink = "white" if 0.3 * red + 0.59 * green + 0.11 * blue < 0.5 else "black"
                text = form.format(round(float(value), 2 if ".2f" in form else 1) + 0.0) if np.isfinite(value) else "–"
                ax.text(j, i, text.replace("+0.0", "0.0"), color=ink, ha="center", va="center")
            ax.set_xticks(range(len(columns)), labels=[f"{sigma:g}" for _, sigma in columns])
            ax.set_yticks(range(len(lines)), labels=[label for _, label in lines])
            ax.tick_params(length=0)
            ax.spines[:].set_visible(False)
            for edge in range(len(blurs), len(columns), len(blurs)):
                ax.axvline(edge - 0.5, color="white", linewidth=2.5)
            for index in range(1, len(lines)):
                if lines[index][0] != lines[index - 1][0]:
                    ax.axhline(index - 0.5, color="white", linewidth=2.5)
            for texture in dict.fromkeys(texture for texture, _ in lines):
                places = [index for index, (other, _) in enumerate(lines) if other == texture]
                ax.text(
                    -0.415,
                    float(np.mean(places)),
                    texture.replace(" (1/f)", "\n1/f"),
                    transform=ax.get_yaxis_transform(),
                    ha="left",
                    va="center",
                    color=GREY,
                )
            for index, noise in enumerate(noises):
                middle = len(blurs) * (index + 0.5) - 0.5
                ax.text(middle, -0.75, f"noise {noise:g} %", ha="center", va="bottom", color=GREY)
            ax.set_title(title, loc="left", pad=17)
            ax.set_xlabel("standard deviation of the blur (px)" if panel == 2 else "")
        times = ";  ".join(f"{label.split(',')[0].split(' (')[0]} {value:.0f}" for label, value in speed.items())
        said = f"ms for a frame of {SIDE} × {SIDE}:  {times};  focal disparity alone {alone_ms:.2g}"
        figure.text(0.01, 0.004, said, color=GREY, fontsize=6.5)
    return figure


if __name__ == "__main__":
    alone("estimators", make)
