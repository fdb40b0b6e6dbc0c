"""``focalgradient serve``: an experiment in participants' browsers."""

from __future__ import annotations

import os
import secrets
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

import focalgradient as fg
from focalgradient.cli.design_options import TASK_FILE, with_trials
from focalgradient.cli.generate import File, Folder, command, options_named
from focalgradient.cli.groups import SERVER
from focalgradient.cli.program import given_option
from focalgradient.errors import InputError, check_installed
from focalgradient.files import refuse_overwriting

if TYPE_CHECKING:
    from focalgradient.web import Study

__all__ = ["serve"]

OPTIONS = {
    **{f"{name} is": f"--{name} is" for name in ("completion", "datapipe", "links", "participants", "store")},
    "as data": "with --data",
}
"""Words of the library's messages, with options instead of parameters."""

Rate = Annotated[int, click.IntRange(1, 1_000_000), "N"]


@command("Run an experiment in participants' browsers.", TASK_FILE, json=False, force=False)
def serve(
    design: Annotated[Path, "DESIGN.toml"],
    /,
    *,
    data: Folder | None = None,
    stimuli: Folder | None = None,
    port: Annotated[int, click.IntRange(0, 65535), "N"] = 8000,
    host: Annotated[str, "ADDRESS"] = "127.0.0.1",
    links: File | None = None,
    store: Annotated[str | None, "URL"] = None,
    trials: File | None = None,
    invite: Annotated[int | None, click.IntRange(1, 10_000), "N"] = None,
    no_open_link: bool = False,
    consent: File | None = None,
    gamma: bool = False,
    completion: Annotated[str | None, "URL"] = None,
    public: Annotated[str | None, "URL"] = None,
    join_rate: Rate = 60,
    guess_rate: Rate = 6,
    export: Folder | None = None,
    participants: Annotated[str, "N"] = "100",
    datapipe: Annotated[str | None, "ID"] = None,
) -> None:
    """Run the experiment of DESIGN.toml (depth rating, thresholds, the cube, pinhole or your own) in browsers.

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

    Parameters
    ----------
    data
        Folder of the data set.
    stimuli
        Folder of the pictures, for depth rating.
    port
        Port to listen on; 0: any free one.
    host
        Address to listen on.
    links
        File of links: labels, digests of links, platform identifiers. Default: beside the data, DIR-links.jsonl.
    store
        Instead of --data, for several servers: store journals and links in a PostgreSQL database, such as
        postgresql://user@host/name. 'focalgradient collect --store' writes the data set.
    trials
        List of trials instead of the design's own (CSV or XLSX), in the format of 'focalgradient trials'.
    invite
        Print N new links, one per person.
    no_open_link
        Only people with an invitation can take part.
    consent
        Consent text, shown before everything else.
    gamma
        Let participants match greys to black and white lines, to estimate their screen's gamma.
    completion
        Address to which participants are redirected at the end, as given by Prolific or SONA.
    public
        Public address of this server, such as https://lab.example.org, for its links.
    join_rate
        Maximum number of people per minute who join by the open link from one address; twice as many may join at once,
        four times as many from all addresses together.
    guess_rate
        Number of wrong passwords per minute for the experimenter's page from one address; further ones are slowed down.
    export
        Instead of serving: write the study as files for JATOS, DataPipe and Pavlovia to this new folder.
    participants
        With --export: trial lists for participants 1 to N, or for A-B, such as 101-150.
    datapipe
        With --export: DataPipe's experiment ID, for its page.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    check_installed(*SERVER)
    from focalgradient.dataset.links import links_beside
    from focalgradient.design.consent import read_consent

    fg.web.check_page()
    agreed = None if consent is None else read_consent(consent)
    if export is not None:
        if server := given_option("data", "links", "store", "invite", "public", "no_open_link"):
            raise InputError(f"{server} requires a server, but --export runs none: leave one of them out.")
        lists = fg.web.Lists(with_trials(fg.web.browser_design(design), trials), stimuli, agreed, gamma=gamma)
        with options_named(OPTIONS):
            labels = fg.web.labels_of(participants)
            pictures = fg.web.export(lists, export, labels, completion=completion, datapipe=datapipe)
        made = f"{len(labels)} trial lists ({labels[0]} to {labels[-1]}) and {pictures} pictures"
        click.echo(f"Written: {export}, with {made}.\n{fg.web.REVEALS}")
        click.echo(f"How to put it on JATOS, DataPipe or Pavlovia: {export / 'HOW-TO.txt'}")
        return
    if data is None and store is None:
        raise InputError("--data is missing: give the folder of the data set, or --export to write the study as files.")
    if store is not None and (data is not None or links is not None):
        raise InputError("--store stores journals and links itself: leave out --data and --links.")
    if datapipe is not None:
        raise InputError("--datapipe is given without --export, to which it belongs: give both.")
    options: dict[str, Any] = {"stimuli": stimuli, "consent": agreed, "completion": completion, "gamma": gamma}
    options["open_link"] = not no_open_link
    if data is not None:
        inputs = [path for path in (design, consent, trials) if path is not None]
        refuse_overwriting(inputs, [links or links_beside(data)])
    loaded = with_trials(fg.web.browser_design(design), trials)
    with options_named(OPTIONS):
        opened = (
            fg.web.open_shared_study(loaded, str(store), **options)
            if data is None
            else nullcontext(fg.web.open_study(loaded, data, links, **options))
        )
        with opened as study:
            limits = fg.web.Limits(joins=join_rate, guesses=guess_rate)
            _serve(study, host, port, public, invite or 0, limits)
    click.echo("Stopped; all acknowledged answers are saved.")


def _serve(study: Study, host: str, port: int, public: str | None, invite: int, limits: Any) -> None:
    """Serve until Ctrl-C."""
    password = os.environ.get("FOCALGRADIENT_PASSWORD") or secrets.token_urlsafe(12)
    if not password.strip():
        raise InputError("FOCALGRADIENT_PASSWORD is blank: set a password, or unset the variable to get a new one.")

    def ready(address: str) -> None:
        base = (public or address).rstrip("/")
        if study.open_link:
            click.echo(f"Open link: {base}/")
        for token in study.people.invite(invite):
            click.echo(f"Invitation: {base}/s/{token}")
        click.echo(f"Experimenter: {base}/experimenter (user: experimenter, password: {password})")
        click.echo("Ctrl-C stops the server; open sessions continue when it runs again.")

    with suppress(KeyboardInterrupt):  # the server has shut down by then, and passes the signal on
        fg.web.run(study, password, host, port, ready, limits=limits, public=public)
