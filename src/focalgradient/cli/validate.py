"""``focalgradient validate``: validation of a data set against BIDS, its design and its journals."""

from __future__ import annotations

import click

import focalgradient as fg
from focalgradient.cli.design_options import TASK_FILE
from focalgradient.cli.generate import Folder, command
from focalgradient.cli.groups import SESSION_S, Workers
from focalgradient.cli.program import show
from focalgradient.errors import InputError

__all__ = ["validate"]


@command("Check a data set of the experiments.", TASK_FILE, force=False)
def validate(folder: Folder, /, *, stimuli: Folder | None = None, export: bool = False, workers: Workers) -> None:
    """Validate the data set in DIR.

    Its files are checked against the BIDS standard (if bids-validator-deno is installed); and every trial of the design
    must be present once, in agreement with its journal, with possible times and answers and its condition's pictures.
    Every problem is listed. Exit code 1: problems were found; 'focalgradient repair' makes damaged sessions readable.
    Nothing is changed, except that --export writes missing tables.

    Takes a few seconds for 20 participants. The workers of a --scheduler must see DIR under the same path.

    \b
    Examples:
      focalgradient validate data
      focalgradient validate data --stimuli pictures

    Parameters
    ----------
    stimuli
        Folder of the pictures shown, to check them too.
    export
        First write the tables of interrupted sessions from their journals.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    from focalgradient.dataset.focus import export_focus, focus_journals

    refused = []
    ways = [(fg.dataset.journals, fg.dataset.export), (focus_journals, export_focus)] if export else []
    for make, journal in [(make, journal) for found, make in ways for journal in found(folder)]:
        try:
            make(journal)
        except InputError as error:
            refused.append(str(error))
    seconds = SESSION_S * sum(1 for _ in folder.glob("sub-*"))
    with fg.dataset.checking_bids(folder) as by_standard, workers.shared(seconds) as executor:
        found = fg.dataset.validate(folder, stimuli, executor=executor)
        wrong = by_standard()
    notes = list(found.notes)
    if wrong is None:
        notes.append(
            f"BIDS was not checked: {fg.dataset.VALIDATOR} is not installed (pip install {fg.dataset.VALIDATOR})."
        )
    problems = list(dict.fromkeys([*refused, *found.problems]))
    problems += [f"BIDS: {' '.join(line.split())}" for line in wrong or ()]
    show(
        {
            "valid": not problems,
            "sessions": found.sessions,
            "trials": found.trials,
            "notes": notes,
            "problems": problems,
        },
        f"Sessions: {found.sessions}",
        f"Trials: {found.trials}",
        *(f"Note: {note}" for note in notes),
        *(f"Problem: {problem}" for problem in problems),
        f"Problems: {len(problems)}" if problems else "Valid.",
    )
    if problems:
        click.get_current_context().exit(1)
