"""``focalgradient serve``: an experiment in participants' browsers."""

from __future__ import annotations

import hashlib
import os
import secrets
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from focalgradient.errors import InputError
from focalgradient.files import read_text, refuse_overwriting

if TYPE_CHECKING:
    from focalgradient.web import Study

__all__ = ["serve"]


@click.command(short_help="Run an experiment in participants' browsers.")
@click.argument("design", metavar="DESIGN.toml", type=click.Path(path_type=Path))
@click.option("--data", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder of the data set.")
@click.option(
    "--stimuli", type=click.Path(path_type=Path), metavar="DIR", help="Folder of the pictures, for depth rating."
)
@click.option(
    "--port", type=click.IntRange(0, 65535), default=8000, show_default=True, metavar="N", help="0: any free one."
)
@click.option("--host", default="127.0.0.1", show_default=True, metavar="ADDRESS", help="Address to listen at.")
@click.option(
    "--links",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Who is who: labels, digests of links, a platform's identifiers. Default: beside the data, DIR-links.jsonl.",
)
@click.option("--invite", type=click.IntRange(1, 10_000), metavar="N", help="Print so many new links, one a person.")
@click.option("--no-open-link", is_flag=True, help="Only people with an invitation take part.")
@click.option("--consent", type=click.Path(path_type=Path), metavar="FILE", help="Text to agree to before all else.")
@click.option("--completion", metavar="URL", help="Where a participant goes at the end, as Prolific or SONA give it.")
@click.option(
    "--public", metavar="URL", help="What people call this server, as https://lab.example.org, for its links."
)
def serve(
    design: Path,
    data: Path,
    stimuli: Path | None,
    port: int,
    host: str,
    links: Path | None,
    invite: int | None,
    no_open_link: bool,
    consent: Path | None,
    completion: str | None,
    public: str | None,
) -> None:
    """Run the experiment of DESIGN.toml (depth rating or the cube) in participants' browsers.

    Reads the design, the pictures of --stimuli, and the links of earlier runs. Writes the same journals and tables as
    'focalgradient run': 'validate' and 'report' read both. Each answer is on the disk before it is acknowledged; a page
    that is closed, or a server that is killed, goes on where it stopped.

    Prints the open link, the links of --invite, and the address and password of the experimenter's page (the variable
    FOCALGRADIENT_PASSWORD, or a new one). Runs as long as it is wanted; Ctrl-C ends it. In the open it runs behind a
    proxy with TLS: docs/web.md.

    \b
    Examples:
      focalgradient serve design.toml --stimuli pictures --data data
      focalgradient serve design.toml --data data --invite 20 --no-open-link --public https://lab.example.org
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    try:
        from focalgradient.web import page_is_built, run
    except ImportError as error:
        raise InputError("the server's libraries are not installed: pip install 'focalgradient[web]'.") from error
    if not page_is_built():
        raise InputError(
            "the page is not built: run 'python hatch_build.py' in the checkout with deno at hand, or install a wheel."
        )
    study = _study(design, data, stimuli, links, consent, completion, open_link=not no_open_link)
    password = os.environ.get("FOCALGRADIENT_PASSWORD") or secrets.token_urlsafe(12)

    def ready(address: str) -> None:
        base = (public or address).rstrip("/")
        if study.open_link:
            click.echo(f"Open link: {base}/")
        for token in study.people.invite(invite or 0):
            click.echo(f"Invitation: {base}/s/{token}")
        click.echo(f"Experimenter: {base}/experimenter (user: experimenter, password: {password})")
        click.echo("Ctrl-C ends; sessions that are open go on when the server runs again.")

    with suppress(KeyboardInterrupt):  # the server has ended in order by then, and gives the signal on
        run(study, password, host, port, ready)
    click.echo("Ended; every answer that was acknowledged is on the disk.")


def _study(
    design: Path,
    data: Path,
    stimuli: Path | None,
    links: Path | None,
    consent: Path | None,
    completion: str | None,
    *,
    open_link: bool,
) -> Study:
    """What is run, of what the options name."""
    from focalgradient.dataset import journals
    from focalgradient.dataset.bids import check_folder
    from focalgradient.design import load_design
    from focalgradient.web import Consent, People, Study

    if completion is not None and not completion.startswith(("https://", "http://")):
        raise InputError(f"--completion is {completion!r}, but must be an address that begins with https://.")
    agreed = None
    if consent is not None:
        text = read_text(consent, "a text to agree to").strip()
        agreed = Consent(text, hashlib.sha256(text.encode()).hexdigest())
    place = links or data.with_name(f"{data.name}-links.jsonl")
    # Not Path.resolve, which links in a circle end with a RuntimeError.
    if Path(os.path.realpath(place)).is_relative_to(os.path.realpath(data)):
        raise InputError(f"--links {place} is inside the data set, but tells who is who: give it a place elsewhere.")
    refuse_overwriting([path for path in (design, consent) if path is not None], [place])
    check_folder(data, "human")
    loaded, there = load_design(design), place.exists()
    taken = {path.name.partition("_")[0].removeprefix("sub-") for path in journals(data)} if data.exists() else set()
    people = People(place, frozenset(taken))
    try:
        return Study(
            loaded,
            data,
            people,
            stimuli=stimuli,
            consent=agreed,
            completion=completion,
            open_link=open_link,
        )
    except BaseException:
        people.close()
        if not there:
            place.unlink(missing_ok=True)
        raise
