"""``focalgradient serve``: an experiment in participants' browsers."""

from __future__ import annotations

import os
import re
import secrets
import tempfile
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from focalgradient.cli.design_options import task_file_option, trials_option, with_trials
from focalgradient.cli.options import SERVER, STORE
from focalgradient.errors import InputError, check_installed
from focalgradient.files import refuse_overwriting

if TYPE_CHECKING:
    from focalgradient.design import Design
    from focalgradient.web import Consent, Limits, Lists, Study

__all__ = ["serve"]


@click.command(short_help="Run an experiment in participants' browsers.")
@click.argument("design", metavar="DESIGN.toml", type=click.Path(path_type=Path))
@click.option("--data", type=click.Path(path_type=Path), metavar="DIR", help="Folder of the data set.")
@click.option(
    "--stimuli", type=click.Path(path_type=Path), metavar="DIR", help="Folder of the pictures, for depth rating."
)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=8000,
    show_default=True,
    metavar="N",
    help="Port to listen on; 0: any free one.",
)
@click.option("--host", default="127.0.0.1", show_default=True, metavar="ADDRESS", help="Address to listen on.")
@click.option(
    "--links",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="File of links: labels, digests of links, platform identifiers. Default: beside the data, DIR-links.jsonl.",
)
@click.option(
    "--store",
    metavar="URL",
    help="Instead of --data, for several servers: store journals and links in a PostgreSQL database, such as "
    "postgresql://user@host/name. 'focalgradient collect --store' writes the data set.",
)
@trials_option
@click.option("--invite", type=click.IntRange(1, 10_000), metavar="N", help="Print N new links, one per person.")
@click.option("--no-open-link", is_flag=True, help="Only people with an invitation can take part.")
@click.option(
    "--consent", type=click.Path(path_type=Path), metavar="FILE", help="Consent text, shown before everything else."
)
@click.option(
    "--gamma",
    is_flag=True,
    help="Let participants match greys to black and white lines, to estimate their screen's gamma.",
)
@click.option(
    "--completion",
    metavar="URL",
    help="Address to which participants are redirected at the end, as given by Prolific or SONA.",
)
@click.option(
    "--public", metavar="URL", help="Public address of this server, such as https://lab.example.org, for its links."
)
@click.option(
    "--join-rate",
    type=click.IntRange(1, 1_000_000),
    default=60,
    show_default=True,
    metavar="N",
    help="Maximum number of people per minute who join by the open link from one address; twice as many may join at "
    "once, four "
    "times as many from all addresses together.",
)
@click.option(
    "--guess-rate",
    type=click.IntRange(1, 1_000_000),
    default=6,
    show_default=True,
    metavar="N",
    help="Maximum number of wrong passwords per minute for the experimenter's page from one address.",
)
@click.option(
    "--export",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Instead of serving: write the study as files for JATOS, DataPipe and Pavlovia to this new folder.",
)
@click.option(
    "--participants",
    default="100",
    show_default=True,
    metavar="N",
    help="With --export: trial lists for participants 1 to N, or for A-B, such as 101-150.",
)
@click.option("--datapipe", metavar="ID", help="With --export: DataPipe's experiment ID, for its page.")
@task_file_option
def serve(
    design: Path,
    data: Path | None,
    stimuli: Path | None,
    port: int,
    host: str,
    links: Path | None,
    store: str | None,
    trials: Path | None,
    invite: int | None,
    no_open_link: bool,
    consent: Path | None,
    gamma: bool,
    completion: str | None,
    public: str | None,
    join_rate: int,
    guess_rate: int,
    export: Path | None,
    participants: str,
    datapipe: str | None,
) -> None:
    """Run the experiment of DESIGN.toml (depth rating or the cube) in participants' browsers.

    Reads the design, the pictures of --stimuli, and the links of earlier runs. Writes the same journals and tables
    as 'focalgradient run': 'validate' and 'report' read both. Each answer is on disk before it is acknowledged; a
    closed page or a stopped server continues where it stopped.

    Prints the open link, the links of --invite, and the address and password of the experimenter's page (the variable
    FOCALGRADIENT_PASSWORD, or a new one). Runs until Ctrl-C. On the internet it must run behind a proxy with TLS: see
    docs/web.md.

    With --store several servers behind one address share a PostgreSQL database (extra 'store'): an answer is committed
    there before it is acknowledged. A database, or schema, contains one study.

    With --export it writes the same page, the pictures and trial lists made in advance to a folder for JATOS, DataPipe
    or Pavlovia; HOW-TO.txt there explains how. 'focalgradient collect' imports their results.

    \b
    Examples:
      focalgradient serve design.toml --stimuli pictures --data data
      focalgradient serve design.toml --data data --invite 20 --no-open-link --public https://lab.example.org
      focalgradient serve design.toml --stimuli pictures --store postgresql://lab@db.example.org/study
      focalgradient serve design.toml --stimuli pictures --export study --participants 60
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    check_installed(*SERVER)
    from focalgradient.web import Limits, Lists, page_is_built

    if not page_is_built():
        raise InputError(
            "the page is not built: run 'python hatch_build.py' in the checkout with deno installed, or install a "
            "wheel."
        )
    agreed = _consent(consent, completion)
    if export is not None:
        _refuse_serving(data, links, store, invite, public, no_open_link=no_open_link)
        lists = Lists(with_trials(_design(design), trials), stimuli, agreed, gamma=gamma)
        _export(lists, completion, export, participants, datapipe)
        return
    if data is None and store is None:
        raise InputError("--data is missing: give the folder of the data set, or --export to write the study as files.")
    if store is not None and (data is not None or links is not None):
        raise InputError("--store stores journals and links itself: leave out --data and --links.")
    if datapipe is not None:
        raise InputError("--datapipe is given without --export, to which it belongs: give both.")
    options = {"stimuli": stimuli, "consent": agreed, "completion": completion, "gamma": gamma}
    options["open_link"] = not no_open_link
    password = os.environ.get("FOCALGRADIENT_PASSWORD") or secrets.token_urlsafe(12)
    with ExitStack() as opened:
        if data is not None:
            study = _study(design, data, links, consent, trials, options)
        else:
            folder = Path(opened.enter_context(tempfile.TemporaryDirectory(prefix="focalgradient-")))
            study = _shared_study(design, str(store), folder, trials, options)
        limits = Limits(joins=join_rate, guesses=guess_rate)
        _serve(study, password, host, port, public, limits, invite or 0)
    click.echo("Stopped; all acknowledged answers are saved.")


def _serve(study: Study, password: str, host: str, port: int, public: str | None, limits: Limits, invite: int) -> None:
    """Serve until Ctrl-C."""
    from focalgradient.web import run

    def ready(address: str) -> None:
        base = (public or address).rstrip("/")
        if study.open_link:
            click.echo(f"Open link: {base}/")
        for token in study.people.invite(invite):
            click.echo(f"Invitation: {base}/s/{token}")
        click.echo(f"Experimenter: {base}/experimenter (user: experimenter, password: {password})")
        click.echo("Ctrl-C stops the server; open sessions continue when it runs again.")

    with suppress(KeyboardInterrupt):  # the server has shut down by then, and passes the signal on
        run(study, password, host, port, ready, limits=limits, public=public)


def _consent(path: Path | None, completion: str | None) -> Consent | None:
    from focalgradient.design.consent import read_consent

    if completion is not None and not completion.startswith(("https://", "http://")):
        raise InputError(f"--completion is {completion!r}, but must be an address that starts with https://.")
    return None if path is None else read_consent(path)


def _refuse_serving(*given: object, no_open_link: bool) -> None:
    """Raise `InputError` for options that require a server."""
    names = ("--data", "--links", "--store", "--invite", "--public", "--no-open-link")
    for name, value in zip(names, (*given, no_open_link or None), strict=True):
        if value is not None:
            raise InputError(f"{name} requires a server, but --export runs none: leave one of them out.")


def _labels(participants: str) -> list[str]:
    """Return the labels of participants, as the server would assign them."""
    found = re.fullmatch(r"(?:([0-9]{1,5})-)?([0-9]{1,5})", participants)
    first, last = (int(found[1] or 1), int(found[2])) if found else (0, 0)
    if not 1 <= first <= last < first + 10_000:
        raise InputError(
            f"--participants is {participants!r}, but must be a number up to 10000, or a range such as 101-150."
        )
    return [f"{number:03}" for number in range(first, last + 1)]


def _export(lists: Lists, completion: str | None, folder: Path, participants: str, datapipe: str | None) -> None:
    from focalgradient.web import export

    labels = _labels(participants)
    if datapipe is not None and not re.fullmatch(r"[A-Za-z0-9_-]{1,64}", datapipe):
        raise InputError(f"--datapipe is {datapipe!r}, but must be an ID of letters and digits.")
    pictures = export(lists, folder, labels, completion=completion, datapipe=datapipe)
    click.echo(
        f"Written: {folder}, with {len(labels)} trial lists ({labels[0]} to {labels[-1]}) and {pictures} pictures."
    )
    click.echo(f"How to put it on JATOS, DataPipe or Pavlovia: {folder / 'HOW-TO.txt'}")


def _design(path: Path) -> Design:
    """Return the design of a study in browsers, which cannot record gaze."""
    from focalgradient.design import load_design

    design = load_design(path)
    gaze = getattr(design, "gaze", "none")
    if gaze != "none":
        raise InputError(f'gaze is {gaze!r} in {path}, but a browser cannot record gaze: set gaze = "none".')
    return design


def _study(
    design: Path, data: Path, links: Path | None, consent: Path | None, trials: Path | None, options: dict[str, Any]
) -> Study:
    """Return the study, with journals and links in local files."""
    from focalgradient.dataset import journals
    from focalgradient.dataset.bids import check_folder
    from focalgradient.dataset.links import links_beside
    from focalgradient.web import People, Study

    place = links or links_beside(data)
    # Path.resolve would raise RuntimeError for circular links.
    if Path(os.path.realpath(place)).is_relative_to(os.path.realpath(data)):
        raise InputError(
            f"--links {place} is inside the data set, but identifies participants: choose a place outside it."
        )
    refuse_overwriting([path for path in (design, consent, trials) if path is not None], [place])
    check_folder(data, "human")
    above = next(one for one in (data, *data.absolute().parents) if one.exists())
    if not os.access(above, os.W_OK):
        raise InputError(f"{above} cannot be written: change its permissions, or give another folder with --data.")
    loaded, there = with_trials(_design(design), trials), place.exists()
    taken = {path.name.partition("_")[0].removeprefix("sub-") for path in journals(data)} if data.exists() else set()
    people = People(place, frozenset(taken), data)
    try:
        return Study(loaded, data, people, **options)
    except BaseException:
        people.close()
        if not there:
            place.unlink(missing_ok=True)
        raise


def _shared_study(design: Path, store: str, folder: Path, trials: Path | None, options: dict[str, Any]) -> Study:
    """Return the study, with journals and links in a database; `folder` is this server's own."""
    from focalgradient.web import Lists, Study

    if not store.startswith(("postgresql://", "postgres://")):
        raise InputError(f"--store is {store!r}, but must be an address such as postgresql://user@host/name.")
    check_installed(*STORE)
    from focalgradient.web.postgres import Postgres, SharedPeople

    loaded = with_trials(_design(design), trials)
    kept = Postgres(store, folder, loaded, Lists(loaded, options["stimuli"]).manifest)
    return Study(loaded, folder, SharedPeople(kept.database), store=kept, **options)
