"""``focalgradient report``: a data set analysed, with figures, tables, methods and provenance."""

from __future__ import annotations

import re
from pathlib import Path

import click

from focalgradient.cli.options import SESSION_S, options_named, positive, shared_options, shared_work, task_file_option
from focalgradient.cli.program import force_option, json_option, resumable, show, writable, write_set
from focalgradient.errors import InputError
from focalgradient.files import printable

__all__ = ["report"]


def _pairs(_: click.Context, option: click.Parameter, given: tuple[str, ...]) -> dict[str, str]:
    """Names as "participant=subject,aperture=fstop"; a comma within a name is no separator unless "=" follows."""
    pairs: dict[str, str] = {}
    for part in (part for one in given if one for part in re.split(r",(?=[^,]*=)", one)):
        name, equals, value = (text.strip() for text in part.partition("="))
        if not (name and equals and value):
            like = "participant=subject,rating=resp" if "--columns" in option.opts else "front=nearest,open=f/5.6"
            raise InputError(f"{option.opts[0]} is {','.join(given)}, but must be pairs like {like}.")
        if pairs.setdefault(name, value) != value:
            raise InputError(f"{option.opts[0]} gives {name} as {pairs[name]} and as {value}: give it once.")
    return pairs


@click.command(short_help="Analyse a data set and write its report.")
@click.argument("folders", metavar="DATASET...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the report.")
@click.option(
    "--bound",
    type=float,
    metavar="RATIO",
    callback=positive(),
    help="Smallest rise of a rating at the largest aperture that would matter, stated in advance.  [default: 1.2]",
)
@click.option("--ordinal", is_flag=True, help="Ratings are steps of a scale, whole numbers, and no ratios.")
@click.option("--bayes", is_flag=True, help="Bayesian models of the ratings, too: some minutes, and the extra bayes.")
@click.option(
    "--observers", is_flag=True, help="Fit observers to the answers and compare them by people held out, too."
)
@click.option(
    "--rules", type=click.Path(path_type=Path), metavar="FILE", help="Rules of exclusion, stated in advance (TOML)."
)
@click.option(
    "--columns",
    metavar="OURS=YOURS,...",
    multiple=True,
    callback=_pairs,
    help="Names in a table of your own: participant=subject,aperture=fstop,fixation=focus,rating=resp; of reports on "
    "the cube: participant=subject,gradient=blur,percept=seen,duration=seconds; of thresholds: level=blur,correct=hit.",
)
@click.option(
    "--conditions",
    metavar="YOURS=OURS,...",
    multiple=True,
    callback=_pairs,
    help="Meaning of your conditions: front=nearest,back=farthest,open=f/5.6,sharp=pinhole; stiff=rigid. Repeatable.",
)
@click.option(
    "--guess-rate",
    type=float,
    metavar="RATE",
    help="Share of right answers without a stimulus, of a table of thresholds: 0.25 for four alternatives, 0 for yes "
    "and no.  [default: of its column alternatives, else 0.5]",
)
@click.option(
    "--focal-length",
    type=float,
    metavar="MM",
    callback=positive(" of millimetres"),
    help="Of the lens, for a table without apertures in millimetres.  [default: 50]",
)
@click.option(
    "--preregister", is_flag=True, help="DATASET is a design (TOML): write the text of a preregistration, without data."
)
@click.option(
    "--effect",
    type=float,
    callback=positive(),
    help="With --preregister: effect to be found, for the number of subjects; a ratio of ratings, of steps, choices "
    "and the cube a ratio of odds.  [default: 1.3; of odds 3; of the cube 1.5]",
)
@click.option(
    "--far-effect",
    type=float,
    callback=positive(),
    help="With --preregister: the same with the farthest object in focus, 1 is none.  [default: 1]",
)
@task_file_option
@shared_options
@force_option
@json_option
def report(
    folders: tuple[Path, ...],
    out: Path,
    bound: float | None,
    ordinal: bool,
    bayes: bool,
    observers: bool,
    rules: Path | None,
    columns: dict[str, str],
    conditions: dict[str, str],
    guess_rate: float | None,
    focal_length: float | None,
    preregister: bool,
    effect: float | None,
    far_effect: float | None,
    workers: int | None,
    scheduler: str | None,
) -> None:
    """Analyse the data set in DATASET, of people or of simulated observers; or a table of your own (CSV, TSV, XLSX).

    Writes report.html (one page, with all pictures), report.md, the figures (PNG, PDF), every table (CSV), all trials
    as one table, and R scripts of the headline test into the folder --out. What can be analysed is; what cannot is
    said there, and here.

    DATASET is a folder of BIDS tables that 'focalgradient run' or 'simulate' wrote. A table of your own has a row for
    each rating with the columns participant, aperture (pinhole, or an f-number like f/5.6), fixation (nearest or
    farthest) and rating, and may have scene, repetition, trial and catch; or a column for each condition. Other names
    are given by --columns, other words in the cells by --conditions. A table of reports on the cube has a row for each
    report with the columns participant, trial, gradient (none, rigid, nonrigid), percept (rigid, nonrigid, none, both)
    and duration in seconds, and may have onset, strength, trial_duration, censored and catch. A table of answers at
    levels, for thresholds, has a row for each trial with the columns participant, level (above 0) and correct (1 or 0),
    or interval and response, and may have condition, session, catch and alternatives (how many there were to choose
    from, for the guess rate).

    A table of judgements by two cues has a row for each trial with the columns participant, first, second (the
    test's difference from the standard by each cue; empty where it was not offered) and larger (1 or 0); one of
    judgements of differences the columns participant, s1, s2, s3 and for quadruples s4, and larger.

    Several data sets of one design are pooled: a meta-analysis with random effects of the main results of each, with a
    forest plot of each result. The report of each data set is written by a command of its own.

    The sessions of a data set are checked by the workers, those of a --scheduler must see it under the same path.

    Takes about 10 s for 20 subjects on two cores; --ordinal a little longer, --observers about a minute, of the cube
    some minutes.

    \b
    Examples:
      focalgradient report demo/ratings.csv --columns participant=subject,fixation=focus --out report --bound 1.2
      focalgradient report data --out report --bound 1.2
      focalgradient report reports.csv --columns participant=subject,percept=seen --out report
      focalgradient report answers.csv --columns level=blur_D --out report
      focalgradient report first-data second-data third-data --out series
      focalgradient report --preregister design.toml --out preregistration
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    from focalgradient.report import Stated, load_rules, make_report, other_than_ratings
    from focalgradient.statistics import Rules

    folder = folders[0]
    inputs = [path for path in (*folders, rules) if path is not None and path.is_file()]
    stated = Stated(Rules()) if rules is None else load_rules(rules)
    if preregister and len(folders) > 1:
        raise InputError("--preregister takes one design: give one file.")
    if preregister:
        from focalgradient.report.preregister import preregistration

        analysing = {
            "--bayes": bayes,
            "--observers": observers,
            "--columns": columns,
            "--conditions": conditions,
            "--focal-length": focal_length,
        }
        analysing["--guess-rate"] = guess_rate is not None
        if wrong := [option for option, value in analysing.items() if value]:
            raise InputError(
                f"{wrong[0]} is of an analysis, but --preregister writes a text without data: leave it out."
            )
        writable(out, ["preregistration.html", "preregistration.md", "rules.toml"], inputs)
        with options_named({"far_effect": "--far-effect", "ordinal is": "--ordinal is", "bound is": "--bound is"}):
            texts = preregistration(
                folder, bound=bound, stated=stated, effect=effect, far_effect=far_effect, ordinal=ordinal
            )
        write_set(out, texts, "preregistration.html")
        text = printable(out / "preregistration.html")
        show({"written": [text]}, f"Done: open {text}")
        return
    if effect is not None or far_effect is not None:
        raise InputError("--effect is of a preregistration: give it with --preregister.")
    writable(out, ["report.html", "report.md", "rules.toml"], inputs)
    of_ratings = {"--bound": bound, "--ordinal": ordinal, "--bayes": bayes, "--focal-length": focal_length}
    given = [option for option, value in of_ratings.items() if value]
    for one in folders:
        if given and one.is_file() and (other := other_than_ratings(one, columns)):
            raise InputError(f"{given[0]} is of depth ratings, but {printable(one)} holds {other}: leave it out.")
    seconds = SESSION_S * sum(1 for one in folders if not one.is_file() for _ in one.glob("sub-*"))
    with (
        resumable("nothing was written.") as say,
        options_named(
            {"equivalence_bound is": "--bound is", "guess_rate is": "--guess-rate is", "guess is": "--guess-rate is"}
        ),
        shared_work(workers, scheduler, seconds) as executor,
    ):
        reports = [
            make_report(
                one,
                bound=bound,
                scale="ordinal" if ordinal else None,
                stated=stated,
                columns=columns,
                conditions=conditions,
                guess_rate=guess_rate,
                focal_length_mm=focal_length,
                bayes=bayes,
                observers=observers,
                executor=executor,
                progress=say,
            )
            for one in folders
        ]
    made = reports[0]
    if len(folders) > 1:
        from focalgradient.report.meta import combined_report, file_names

        made = combined_report(dict(zip(file_names([str(one) for one in folders]), reports, strict=True)))
    writable(out, list(made.files), inputs)
    write_set(out, made.files, "report.html")
    for kind, sentences in (("Problem", made.problems), ("Note", made.notices)):
        for sentence in sentences:
            click.echo(f"{kind}: {' '.join(sentence.split())}", err=True)
    written = [printable(out / name) for name in made.files]
    summary = {"problems": list(made.problems), "notices": list(made.notices), "results": list(made.results)}
    show(summary | {"written": written}, f"Done: open {printable(out / 'report.html')}")
