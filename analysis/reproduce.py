"""Make every figure, its numbers and the report: `python analysis/reproduce.py [--out results] [--full]`."""

from __future__ import annotations

import argparse
import hashlib
import json
import shutil
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import accommodation
import accommodation_experiments
import autofocus
import check
import chromatic_stimuli
import colour_and_depth
import estimators
import eye_depth
import eye_gaussian
import eye_track
import eyes
import fig1
import fig2
import fig2_measured
import fig3
import fig4
import fig5
import fig6
import grossman
import motorcycle
import necker
import necker_strip
import observers
import observers_recovery
import observers_sensitivity
import observers_wrong
import outlines
import people
import published
import scene
import simulated
import stimulus_sheet
import wavelength_in_focus
from claims import answers
from figure_faults import figure_faults
from report import Progress, Shown, images, numbers_json, report_html
from tqdm import tqdm

import focalgradient
from focalgradient import InputError
from focalgradient.plotting import new_figure, style
from focalgradient.report import make_report

FIGURES: tuple[
    tuple[str, Callable[..., Shown], float], ...
] = (  # in the order of the report: figures of the paper, then others; duration in seconds, for the progress bar
    ("fig1", fig1.make, 45.0),
    ("fig2", fig2.make, 1.0),
    ("fig2_measured", fig2_measured.make, 30.0),
    ("fig3", fig3.make, 3.0),
    ("fig4", fig4.make, 25.0),
    ("fig5", fig5.make, 20.0),
    ("fig6", fig6.make, 1.0),
    ("necker", necker.make, 3.0),
    ("estimators", estimators.make, 60.0),
    ("check", check.make, 20.0),
    ("grossman", grossman.make, 8.0),
    ("autofocus", autofocus.make, 20.0),
    ("scene", scene.make, 8.0),
    ("outlines", outlines.make, 120.0),
    ("motorcycle", motorcycle.make, 25.0),
    ("eyes", eyes.make, 15.0),
    ("eye_gaussian", eye_gaussian.make, 10.0),
    ("eye_depth", eye_depth.make, 60.0),
    ("eye_track", eye_track.make, 25.0),
    ("chromatic_stimuli", chromatic_stimuli.make, 20.0),
    ("colour_and_depth", colour_and_depth.make, 30.0),
    ("wavelength_in_focus", wavelength_in_focus.make, 15.0),
    ("accommodation", accommodation.make, 15.0),
    ("accommodation_experiments", accommodation_experiments.make, 3000.0),
    ("people", people.make, 600.0),
    ("necker_strip", necker_strip.make, 5.0),
    ("stimulus_sheet", stimulus_sheet.make, 15.0),
    ("observers", observers.make, 20.0),
    ("observers_sensitivity", observers_sensitivity.make, 40.0),
    ("observers_recovery", observers_recovery.make, 20.0),
    ("observers_wrong", observers_wrong.make, 25.0),
    ("published", published.make, 45.0),
)

OF_DATASET = {"fig3", "necker"}
"""Figures of answers, from one data set: that of simulated observers here, as people have not been tested."""

ONLY_FULL = {"accommodation_experiments", "people"}
"""Figures that take minutes with any amount of data."""

NEED_MITSUBA = {"fig1", "fig4", "fig5"}  # omitted with a message if it cannot be loaded

REMARK = (
    "Blur grows with the distance from the plane of focus. These figures show the law, how precisely it gives "
    "distance, and what the toolkit recovers. The views are rendered, so that the true depth of every pixel is known: "
    "by a ray caster or a path tracer that is independent of the depth core, or, where a caption says so, by blurring "
    "a flat picture. All answers shown are those of simulated observers, and the pictures are marked so."
)


FIRST = "fig3"
"""Figure that is made first, as most readers look for it; the order of the report is unaffected."""

UNFINISHED = "unfinished"
"""Folder for unfinished results, from which an interrupted run continues."""


def reproduce(out: Path, *, full: bool = False, quiet: bool = False) -> list[str]:
    """Make all figures and move them into `out` together, or not at all; continue an interrupted run.

    Parameters
    ----------
    out
        Folder for the figures (PNG, PDF), ``numbers.json``, ``report.html``, the data set of the simulated observers
        (``simulated``) and its report (``simulated_report``); created if it does not exist.
    full
        True for more data, which takes longer.
    quiet
        True to hide the progress bar.

    Returns
    -------
    list of str
        Content that is cut off or covered, of the figures drawn by this call.
    """
    faults: list[str] = []
    folder = out / UNFINISHED
    _begin(folder, full)
    bar_format = "{desc}{percentage:3.0f}%|{bar}| {elapsed} < {remaining}"
    of_dataset = any(name in OF_DATASET for name, _, _ in FIGURES)
    wanted = [one for one in FIGURES if full or one[0] not in ONLY_FULL]
    taking_part = simulated.seconds(full=full)
    whole = sum(seconds for _, _, seconds in wanted) + of_dataset * taking_part
    with tqdm(total=whole, bar_format=bar_format, smoothing=0, disable=quiet) as bar:
        done = 0.0

        def run(name: str, seconds: float, make: Callable[[Progress], Any]) -> Any:
            """Make one result, and advance the bar by its duration."""
            nonlocal done
            bar.set_description(name.ljust(15))
            made = make(lambda share: bar.update(done + share * seconds - bar.n))
            done += seconds
            bar.update(done - bar.n)
            return made

        dataset, answering = folder / "simulated", folder / "answering"
        for name, make, seconds in sorted(wanted, key=lambda one: one[0] != FIRST):
            if (folder / f"{name}.json").exists():
                run(name, seconds, lambda progress: None)
                continue
            if name in OF_DATASET and not dataset.exists():
                run(
                    "observers",
                    taking_part,
                    lambda progress: simulated.take_part(
                        answering,
                        full=full,
                        progress=progress,
                        name=lambda what: bar.set_description(what.ljust(15)),
                    ),
                )
                answering.replace(dataset)
            try:
                drawn = partial(make, dataset) if name in OF_DATASET else make
                shown = run(name, seconds, partial(_made, drawn, full=full))
                with style():
                    faults += [f"{name}: {fault}" for fault in figure_faults(shown.figure)]
                _keep(folder, name, shown)
            except InputError as error:
                if name not in NEED_MITSUBA:
                    raise
                bar.write(f"{name} is left out: {error}", file=sys.stderr)
                done += seconds
            else:
                if name == FIRST and not quiet:
                    bar.write(f"{name} is made: {folder / name}.png. The others follow.", file=sys.stderr)
        if dataset.exists():
            (folder / "simulated_report").mkdir(exist_ok=True)
            for name, content in make_report(dataset).files.items():
                (folder / "simulated_report" / name).write_bytes(content)
    figures = {name: shown for name, _, _ in wanted if (shown := _kept(folder, name)) is not None}
    pngs = {name: (folder / f"{name}.png").read_bytes() for name in figures}
    numbers = numbers_json(figures)
    (folder / "numbers.json").write_text(numbers, encoding="utf-8")
    report = report_html(figures, pngs, REMARK, answers(json.loads(numbers)))
    (folder / "report.html").write_text(report, encoding="utf-8")
    for name in (KEY, *(f"{name}.json" for name in figures)):
        (folder / name).unlink()
    for made in folder.iterdir():
        if made.is_dir():
            shutil.rmtree(out / made.name, ignore_errors=True)
        made.replace(out / made.name)
    folder.rmdir()
    return faults


KEY = "made-by"
"""File that identifies the program that made the unfinished results."""


def _begin(folder: Path, full: bool) -> None:
    """Create the folder of unfinished results; remove those of another program or amount of data."""
    own = hashlib.sha256(f"{full} {sys.version} {focalgradient.__version__}".encode())
    for root in (Path(focalgradient.__file__).parent, Path(__file__).parent):
        for file in sorted(root.rglob("*.py")):
            own.update(file.read_bytes())
    key = folder / KEY
    if not key.exists() or key.read_text(encoding="utf-8") != own.hexdigest():
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        key.write_text(own.hexdigest(), encoding="utf-8")


def _keep(folder: Path, name: str, shown: Shown) -> None:
    """Write the files of a figure, then its texts and numbers, whose presence marks it as finished."""
    for kind, content in images(shown).items():
        (folder / f"{name}.{kind}").write_bytes(content)
    words = folder / f"{name}.json.part"
    words.write_text(numbers_json({name: shown}), encoding="utf-8")
    words.replace(folder / f"{name}.json")


def _kept(folder: Path, name: str) -> Shown | None:
    """Read a figure's texts and numbers; None if it was omitted."""
    path = folder / f"{name}.json"
    if not path.exists():
        return None
    about = json.loads(path.read_text(encoding="utf-8"))[name]
    return Shown(about["title"], tuple(about["caption"]), new_figure(), about["summary"], about["plotted"])


def _made(make: Callable[..., Shown], progress: Progress, *, full: bool) -> Shown:
    return make(full=full, progress=progress)


def main() -> int:
    parser = argparse.ArgumentParser(description="Make every figure, its numbers and the report.")
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the results (default: results)")
    parser.add_argument("--full", action="store_true", help="more data; takes several times longer")
    options = parser.parse_args()
    try:
        faults = reproduce(options.out, full=options.full)
    except KeyboardInterrupt:
        print(
            f"\nInterrupted: earlier results in {options.out} are as they were; the same command goes on from "
            f"{options.out / UNFINISHED}.",
            file=sys.stderr,
        )
        return 130
    except OSError as error:
        print(f"The results cannot be written to {options.out}: {error.strerror}.", file=sys.stderr)
        return 2
    print(f"Done: open {options.out / 'report.html'}")
    for fault in faults:
        print(f"A figure has content that is cut off or covered: {fault}.", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
