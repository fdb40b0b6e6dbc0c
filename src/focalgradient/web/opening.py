"""Study of a design, with its journals and links in files, or in a database that several servers share."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from focalgradient.dataset import journals
from focalgradient.dataset.bids import check_folder
from focalgradient.dataset.links import links_beside
from focalgradient.design import Design, load_design
from focalgradient.errors import InputError, check_installed
from focalgradient.files import existing
from focalgradient.web.lists import Lists
from focalgradient.web.people import People
from focalgradient.web.study import Study

__all__ = ["browser_design", "open_shared_study", "open_study"]


def browser_design(path: Path) -> Design:
    """Read the design of a study in browsers.

    Raises
    ------
    InputError
        If it is invalid, or records gaze, which a browser cannot.
    """
    design = load_design(path)
    gaze = getattr(design, "gaze", "none")
    if gaze != "none":
        raise InputError(f'gaze is {gaze!r} in {path}, but a browser cannot record gaze: set gaze = "none".')
    return design


def open_study(design: Design, data: Path, links: Path | None = None, **options: Any) -> Study:
    """Return a study with journals and links in local files, continued if they exist; close it at the end.

    Parameters
    ----------
    design
        Design that a browser can run.
    data
        Folder of the data set.
    links
        File of links, which identifies participants; default: beside the data, DIR-links.jsonl.
    options
        As for `Study`: stimuli, consent, completion, gamma, open_link.

    Raises
    ------
    InputError
        If the data cannot be written or are not those of people, the links lie inside them, another server uses either,
        or `Study` refuses the design.
    """
    place = links or links_beside(data)
    # Path.resolve would raise RuntimeError for circular links.
    if Path(os.path.realpath(place)).is_relative_to(os.path.realpath(data)):
        raise InputError(
            f"links is {place}, inside the data set, but identifies participants: choose a place outside it."
        )
    check_folder(data, "human")
    if not os.access(above := existing(data), os.W_OK):
        raise InputError(f"{above} cannot be written: change its permissions, or give another folder as data.")
    is_new = not place.exists()
    taken = {path.name.partition("_")[0].removeprefix("sub-") for path in journals(data)} if data.exists() else set()
    people = People(place, frozenset(taken), data)
    try:
        return Study(design, data, people, **options)
    except BaseException:
        people.close()
        if is_new:
            place.unlink(missing_ok=True)
        raise


@contextmanager
def open_shared_study(design: Design, store: str, stimuli: Path | None = None, **options: Any) -> Iterator[Study]:
    """Open a study whose journals and links are in a PostgreSQL database, which several servers may share.

    Parameters
    ----------
    design
        Design that a browser can run; the same for all servers.
    store
        Address of the database, such as ``postgresql://user@host/name``.
    stimuli, options
        As for `Study`.

    Raises
    ------
    InputError
        If the address is none, psycopg is not installed, or the database cannot be used or contains another study.
    """
    if not store.startswith(("postgresql://", "postgres://")):
        raise InputError(f"store is {store!r}, but must be an address such as postgresql://user@host/name.")
    check_installed("the store", "store", "psycopg")
    from focalgradient.web.postgres import Postgres, SharedPeople

    with tempfile.TemporaryDirectory(prefix="focalgradient-") as own:
        folder = Path(own)
        kept = Postgres(store, folder, design, Lists(design, stimuli).manifest)
        yield Study(design, folder, SharedPeople(kept.database), store=kept, stimuli=stimuli, **options)
