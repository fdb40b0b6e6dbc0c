"""Start of a session in the window: informed consent, and the participant's data that the command line lacks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from focalgradient.design.consent import Consent
from focalgradient.design.form import GIVEN, USUAL, check_about
from focalgradient.lab.experiment import Quit, Sitting
from focalgradient.lab.forms import form, pages
from focalgradient.lab.options import SessionOptions
from focalgradient.lab.preparation import check_session

if TYPE_CHECKING:
    from focalgradient.lab.screen import Screen

__all__ = ["agree", "ask_participant"]


def agree(window: Screen, consent: Consent) -> str:
    """Show the consent text page by page; return the time of agreement (ISO 8601), or raise `Quit` if refused."""
    words = window.words
    *first, last = consent.texts
    pages(window, first, "consent")
    foot = words("consent.keys", yes=words.yes.upper(), no=words.no.upper())
    if pages(window, [last], "consent", keys=(words.yes, words.no), foot=foot) == words.no:
        raise Quit
    return datetime.now(UTC).isoformat(timespec="seconds")


def ask_participant(sitting: Sitting, options: SessionOptions) -> Mapping[str, str]:
    """Ask for missing data until they are valid; return the data to be recorded about the participant."""
    words = sitting.words
    given = {name: getattr(options, name) for name in GIVEN if getattr(options, name)}
    asked = [name for name in sitting.design.ask if name not in given]
    if sitting.participant:
        # If the command line gives the label, the usual questions are asked only if the design changed its default.
        asks = tuple(sitting.design.ask)
        if options.resume:
            asked = []
        elif asks == type(sitting.design).model_fields["ask"].default:
            asked = [name for name in asked if name not in USUAL]
    else:
        asked = ["participant", *([] if options.session else ["session"]), *asked]
    if not asked:
        return given

    def check(typed: Mapping[str, str]) -> None:
        check_about({name: text for name, text in typed.items() if name in GIVEN}, GIVEN)
        if "participant" not in typed:
            return
        session = typed.get("session") or options.session
        check_session(replace(options, participant=typed["participant"], session=session), sitting.design)
        sitting.participant, options.session = typed["participant"], session

    fields = {name: (words(f"form.{name}"), words(f"form.{name}_hint")) for name in asked}
    typed = form(sitting.screen, words("form.title"), fields, check)
    return given | {name: text for name, text in typed.items() if text and name not in ("participant", "session")}
