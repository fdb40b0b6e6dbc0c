"""``focalgradient report``: analysis of a data set, with figures, tables, methods and provenance."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

import focalgradient as fg
from focalgradient.cli.design_options import TASK_FILE
from focalgradient.cli.generate import File, Folder, command, options_named, sentences
from focalgradient.cli.groups import SESSION_S, Workers
from focalgradient.cli.program import given_option, resumable, show, writable, write_set
from focalgradient.errors import InputError, entries_as_options
from focalgradient.files import printable
from focalgradient.quantities import MILLIMETRES, POSITIVE

if TYPE_CHECKING:
    from focalgradient.user_tables.files import UserTable

__all__ = ["report"]

NAMES = {
    "equivalence_bound is": "--bound is",
    "bound is": "--bound is",
    "scale is": "--ordinal is",
    "bayes is": "--bayes is",
    "focal_length_mm is": "--focal-length is",
    "guess_rate is": "--guess-rate is",
    "guess is": "--guess-rate is",
    "by states": "--by states",
    "guess rate is not known: give it": "guess rate is not known: give --guess-rate",
}
"""Options by what the library's messages call them."""


def _pairs(option: str, given: tuple[str, ...]) -> dict[str, str]:
    """Parse pairs such as "participant=subject,aperture=fstop"; a comma separates only if "=" follows."""
    pairs: dict[str, str] = {}
    for part in (part for one in given if one for part in re.split(r",(?=[^,]*=)", one)):
        name, equals, value = (text.strip() for text in part.partition("="))
        if not (name and equals and value):
            like = "participant=subject,rating=resp" if option == "--columns" else "front=nearest,open=f/5.6"
            raise InputError(f"{option} is {','.join(given)}, but must be pairs such as {like}.")
        if pairs.setdefault(name, value) != value:
            raise InputError(f"{option} gives {name} as {pairs[name]} and as {value}: give it once.")
    return pairs


def _where(given: tuple[str, ...]) -> dict[str, list[str]]:
    """Parse conditions on rows such as "trial_type=slider" as values by column."""
    chosen: dict[str, list[str]] = {}
    for pair in given:
        name, equals, value = (text.strip() for text in pair.partition("="))
        if not (name and equals):
            raise InputError(f"--where is {pair}, but must be a column and its value, such as trial_type=slider.")
        chosen.setdefault(name, []).append(value)
    return chosen


def _data_sets(
    folders: tuple[Path, ...], columns: dict[str, str], separate: bool
) -> tuple[list[Path | UserTable], list[str]]:
    """Return the data sets, with notices: folders, and tables, which are one unless they are `separate` experiments."""
    found = [fg.user_tables.read_table(path) if path.is_file() else path for path in folders]
    tables = [table for table in found if isinstance(table, fg.user_tables.UserTable)]
    if len(tables) < 2 or len(tables) < len(found):
        if separate:
            raise InputError("--separate is for several tables: leave it out.")
        return found, []
    participant = columns.get("participant", columns.get("participant_id"))
    sets, notices = fg.user_tables.data_sets(tables, participant, separate=separate)
    return [*sets], notices


@command("Analyse a data set and write its report.", TASK_FILE)
def report(
    folders: Annotated[tuple[Path, ...], "DATASET..."],
    /,
    *,
    out: Folder | None = None,
    bound: Annotated[float | None, POSITIVE, "RATIO"] = None,
    ordinal: bool = False,
    bayes: bool = False,
    observers: bool = False,
    rules: File | None = None,
    columns: Annotated[tuple[str, ...], "OURS=YOURS,..."] = (),
    conditions: Annotated[tuple[str, ...], "YOURS=OURS,..."] = (),
    where: Annotated[tuple[str, ...], "NAME=VALUE"] = (),
    by: Annotated[tuple[str, ...], "COLUMN"] = (),
    order: Annotated[tuple[str, ...], "WORD,WORD,..."] = (),
    explain: bool = False,
    separate: bool = False,
    guess_rate: Annotated[float | None, "RATE"] = None,
    focal_length: Annotated[float | None, MILLIMETRES] = None,
    preregister: bool = False,
    effect: Annotated[float | None, POSITIVE, "FACTOR"] = None,
    far_effect: Annotated[float | None, POSITIVE, "FACTOR"] = None,
    between: Annotated[float | None, "SD"] = None,
    between_scenes: Annotated[float | None, "SD"] = None,
    noise: Annotated[float | None, "SD"] = None,
    workers: Workers,
) -> None:
    """Analyse the data set DATASET of people or simulated observers, or a table of your own (CSV, TSV, XLSX, JSON).

    Writes report.html (one page, with all pictures), report.md, the figures (PNG, PDF), every table (CSV), all trials
    as one table, and R scripts of the headline test to the folder --out. Analyses that cannot be computed are listed in
    the report and on standard error.

    DATASET is a folder of BIDS tables that 'focalgradient run' or 'simulate' wrote. A table of your own has a row for
    each rating with the columns participant, aperture (pinhole, or an f-number like f/5.6), fixation (nearest or
    farthest) and rating, and may have scene, repetition, trial and catch; or a column for each condition. Other names
    are given by --columns, other cell values by --conditions. A table of reports on the cube has a row for each
    report with the columns participant, trial, gradient (none, rigid, nonrigid), percept (rigid, nonrigid, none, both)
    and duration in seconds, and may have onset, strength, trial_duration, censored and catch. A table of answers at
    levels, for thresholds, has a row for each trial with the columns participant, level (above 0) and correct (1 or 0),
    or interval and response, and may have condition, session, catch and alternatives (their number, for the guess
    rate).

    Several tables are read as one if they have the same columns, if a participant occurs in two, or if one has a single
    participant. Others, tables of experiments that are --separate, and several folders of data sets are pooled: a
    random-effects meta-analysis of their main results, with a forest plot of each result. The report of each data set
    is written by a separate command.

    The workers check the sessions of a data set; those of a --scheduler must see it under the same path.

    Takes about 10 s for 20 subjects on two cores; --ordinal a little longer, --observers about a minute (cube: some
    minutes).

    \b
    Examples:
      focalgradient report demo/ratings.csv --columns participant=subject,fixation=focus --out report --bound 1.2
      focalgradient report data/*.csv --where trial_type=slider --explain --out report
      focalgradient report data --out report --bound 1.2
      focalgradient report reports.csv --columns participant=subject,percept=seen --out report
      focalgradient report answers.csv --columns level=blur_D --out report
      focalgradient report first-data second-data third-data --out series
      focalgradient report --preregister design.toml --out preregistration

    Parameters
    ----------
    out
        Folder for the report; required, except with --explain.
    bound
        Equivalence bound: smallest relevant ratio of ratings at the largest aperture, set in advance.  [default: 1.2]
    ordinal
        Ratings are steps of a scale (whole numbers) or, with --by, places on a line, not ratios.
    bayes
        Also fit Bayesian models of the ratings; takes some minutes, and requires the extra bayes.
    observers
        Also fit observer models to the answers, and compare them by cross-validation over participants.
    rules
        Exclusion criteria, set in advance (TOML).
    columns
        Your names of the columns of a table, one to each of ours; --explain prints how each column is interpreted.

        \b
        participant=subject   all tables
        rating=resp           ratings, or depth_*
        aperture=fstop        ratings (aperture_mm: mm)
        fixation=focus        ratings; optional
        scene=picture         ratings; optional
        response_time=rt      ratings; optional
        level=blur_D          thresholds
        correct=hit           thresholds
        interval=side         thresholds: the right one; with response
        response=key          thresholds: the chosen one
        condition=contrast    thresholds and detection; optional
        gradient=blur         cube
        percept=seen          cube
        duration=seconds      cube
        signal=present        detection
        response=said         detection
    where
        Only rows of a table whose column NAME has the value VALUE: trial_type=slider. Repeatable: several values of one
        column add rows, several columns narrow them down.
    by
        Column of a table of ratings whose effect is tested instead of the depth effect: the slope of a number, such as
        blur_D, or the contrasts of a factor (NAME=factor where its levels are numbers) with its level of reference
        (NAME=LEVEL): else that without blur, the smallest number, a word such as low, or the first of the alphabet.
        Those that vary between participants are adjusted for one another. Repeatable.  [default: the apertures of a
        table without fixations] Of a table of thresholds the condition; NAME=LEVEL states the reference of the ratios.
    order
        Answers in words, from the least to the most: none,slight,strong. They are steps, as with --ordinal; with --by
        their numbers are averaged, without an ordinal model. Repeatable: then each is one word, which may hold commas.
    explain
        Print how each column of a table is interpreted, and compute nothing.
    separate
        Each of several tables is an experiment of its own, with people of its own: pool their results.
    conditions
        Meaning of your conditions: front=nearest,back=farthest,open=f/5.6,sharp=pinhole; stiff=rigid. Repeatable.
    guess_rate
        Proportion of correct answers without a stimulus, for a table of thresholds: 0.25 for four alternatives, 0 for
        yes and no.  [default: from its column alternatives, else 0.5]
    focal_length
        Focal length of the lens in mm, for a table without apertures in millimetres.  [default: 50]
    preregister
        DATASET is a design (TOML): write the text of a preregistration, without data.
    effect
        With --preregister: effect to be detected, for the number of subjects; a ratio of ratings; for steps, choices
        and the cube an odds ratio.  [default: 1.3; odds ratios 3; cube 1.5]
    far_effect
        With --preregister: effect with the farthest object in focus; 1 means none.  [default: 1]
    between
        With --preregister: SD over subjects of the log of each effect, as for 'focalgradient power'.
    between_scenes
        With --preregister: the same over scenes.
    noise
        With --preregister: SD of the log of a single rating, of ratio scales.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    folder, pairs = folders[0], _pairs("--columns", columns)
    meanings = _pairs("--conditions", conditions)
    chosen = _where(where)
    steps = order[0].split(",") if len(order) == 1 else order
    inputs = [path for path in (*folders, rules) if path is not None and path.is_file()]
    assumed: dict[str, Any] = {"effect": effect, "far_effect": far_effect}
    assumed |= {"between": between, "between_scenes": between_scenes, "noise": noise}
    stated = fg.report.Stated(fg.statistics.Rules()) if rules is None else fg.report.load_rules(rules)
    if preregister and len(folders) > 1:
        raise InputError("--preregister takes one design: give one file.")
    if out is None:
        if not explain:
            if not preregister:
                _data_sets(folders, pairs, separate)  # a file that is not a table is named first
            raise InputError("--out is missing: give the folder for the report.")
        out = Path()
    if preregister:
        from focalgradient.report.preregister import preregistration

        if wrong := given_option(
            *("bayes", "observers", "columns", "conditions", "where"),
            *("separate", "by", "order", "focal_length", "guess_rate"),
        ):
            raise InputError(
                f"{wrong} belongs to an analysis, but --preregister writes a text without data: leave it out."
            )
        writable(out, ["preregistration.html", "preregistration.md", "rules.toml"], inputs)
        with (
            resumable("nothing was written.") as say,
            options_named(sentences({name: f"--{name.replace('_', '-')}" for name in (*assumed, "ordinal", "bound")})),
        ):
            texts = preregistration(
                folder,
                bound=bound,
                stated=stated,
                ordinal=ordinal,
                progress=say,
                **assumed,
            )
        write_set(out, texts, "preregistration.html")
        text = printable(out / "preregistration.html")
        show({"written": [text]}, f"Done: open {text}")
        return
    if explain:
        from focalgradient.report.reading import explained_table

        with options_named(NAMES):
            for group in _data_sets(folders, pairs, separate)[0]:
                for line in explained_table(group, pairs, meanings, chosen, by, steps, guess_rate, steps=ordinal):
                    click.echo(entries_as_options(line))
        return
    if wrong := given_option(*assumed):
        raise InputError(f"{wrong} belongs to a preregistration: give --preregister too.")
    writable(out, ["report.html", "report.md", "rules.toml"], inputs)
    sets, notices = _data_sets(folders, pairs, separate)
    seconds = SESSION_S * sum(1 for one in folders if not one.is_file() for _ in one.glob("sub-*"))
    with (
        resumable("nothing was written.") as say,
        options_named(NAMES),
        workers.shared(seconds) as executor,
    ):
        reports = [
            fg.report.make_report(
                one,
                bound=bound,
                scale="ordinal" if ordinal else None,
                stated=stated,
                columns=pairs,
                conditions=meanings,
                guess_rate=guess_rate,
                where=chosen,
                by=by,
                order=steps,
                focal_length_mm=focal_length,
                bayes=bayes,
                observers=observers,
                executor=executor,
                progress=say,
            )
            for one in sets
        ]
    made = reports[0]
    if len(reports) > 1:
        from focalgradient.report.meta import combined_report, file_names

        places = [str(one.paths[0] if isinstance(one, fg.user_tables.UserTable) else one) for one in sets]
        made = combined_report(dict(zip(file_names(places), reports, strict=True)), notices)
    writable(out, list(made.files), inputs)
    write_set(out, made.files, "report.html")
    for kind, said in (("Problem", made.problems), ("Note", made.notices)):
        for sentence in said:
            click.echo(f"{kind}: {entries_as_options(' '.join(sentence.split()))}", err=True)
    if made.results and "reason" in (first := made.results[0]):
        is_all = all("reason" in result for result in made.results)
        is_rated = folder.is_file() and first["experiment"] in ("depth_rating", "ratings_by_condition")
        remedy = " Test another column of the table with --by." if is_all and is_rated and not by else ""
        untested = "No effect was tested" if is_all else f"Not tested: {first['what']}"
        click.echo(f"Note: {untested}. {first['reason']}{remedy}", err=True)
    written = [printable(out / name) for name in made.files]
    summary = {"problems": list(made.problems), "notices": list(made.notices), "results": list(made.results)}
    show(summary | {"written": written}, f"Done: open {printable(out / 'report.html')}")
