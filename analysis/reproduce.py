"""Make every figure, its numbers and the report: `python analysis/reproduce.py [--out results] [--full]`."""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import autofocus
import check
import estimators
import eye_depth
import eye_gaussian
import fig1
import fig2
import fig2_measured
import fig4
import fig5
import fig6
import motorcycle
import necker_strip
import scene
from report import Shown, images, numbers_json, report_html
from tqdm import tqdm

from focalgradient import InputError

FIGURES = (  # in the report's order; seconds that each takes, for an even progress bar
    ("fig1", fig1.make, 20.0),
    ("fig6", fig6.make, 1.0),
    ("fig2", fig2.make, 1.0),
    ("fig2_measured", fig2_measured.make, 15.0),
    ("scene", scene.make, 5.0),
    ("fig4", fig4.make, 15.0),
    ("fig5", fig5.make, 15.0),
    ("estimators", estimators.make, 30.0),
    ("check", check.make, 15.0),
    ("autofocus", autofocus.make, 15.0),
    ("motorcycle", motorcycle.make, 10.0),
    ("eye_gaussian", eye_gaussian.make, 6.0),
    ("eye_depth", eye_depth.make, 30.0),
    ("necker_strip", necker_strip.make, 4.0),
)

NEED_MITSUBA = {"fig1", "fig4", "fig5"}  # left out, and said so, where it cannot be loaded

REMARK = (
    "Blur grows with the distance from the plane of focus. These figures show the law, how well it can tell distance, "
    "and what the toolkit recovers. The views are rendered, so that the true depth of every pixel is known: by a ray "
    "caster that knows nothing of the depth core, or, where a caption says so, by blurring a flat picture."
)


def reproduce(out: Path, *, full: bool = False, quiet: bool = False) -> None:
    """Make all figures and move them into `out` together, or not at all.

    Parameters
    ----------
    out
        Folder for the figures (PNG, PDF), ``numbers.json`` and ``report.html``; made if it does not exist.
    full
        More data; takes longer.
    quiet
        No progress bar.
    """
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".partial-", dir=out) as folder:
        figures: dict[str, Shown] = {}
        pngs: dict[str, bytes] = {}
        bar_format = "{desc}{percentage:3.0f}%|{bar}| {elapsed} < {remaining}"
        with tqdm(total=sum(seconds for _, _, seconds in FIGURES), bar_format=bar_format, disable=quiet) as bar:
            done = 0.0
            for name, make, seconds in FIGURES:
                bar.set_description(name.ljust(13))

                def progress(share: float, start: float = done, seconds: float = seconds) -> None:
                    bar.update(start + share * seconds - bar.n)

                try:
                    figures[name] = make(full=full, progress=progress)
                except InputError as error:
                    if name not in NEED_MITSUBA:
                        raise
                    bar.write(f"{name} is left out: {error}", file=sys.stderr)
                    done += seconds
                    continue
                for kind, content in images(figures[name]).items():
                    Path(folder, f"{name}.{kind}").write_bytes(content)
                    if kind == "png":
                        pngs[name] = content
                progress(1.0)
                done += seconds
        Path(folder, "numbers.json").write_text(numbers_json(figures), encoding="utf-8")
        Path(folder, "report.html").write_text(report_html(figures, pngs, REMARK), encoding="utf-8")
        for file in Path(folder).iterdir():
            file.replace(out / file.name)


def main() -> int:
    parser = argparse.ArgumentParser(description="Make every figure, its numbers and the report.")
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the results (default: results)")
    parser.add_argument("--full", action="store_true", help="more data; takes several times longer")
    options = parser.parse_args()
    try:
        reproduce(options.out, full=options.full)
    except KeyboardInterrupt:
        print(f"\nInterrupted: {options.out} is as it was.", file=sys.stderr)
        return 130
    except OSError as error:
        print(f"The results cannot be written to {options.out}: {error.strerror}.", file=sys.stderr)
        return 2
    print(f"Done: open {options.out / 'report.html'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
