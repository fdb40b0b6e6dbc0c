"""Participant's data: what the command line does not give is asked for on the screen, as the design requires."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from focalgradient.design.form import GIVEN, USUAL, check_about
from focalgradient.lab.experiment import Sitting
from focalgradient.lab.forms import form
from focalgradient.lab.options import SessionOptions
from focalgradient.lab.preparation import check_session

__all__ = ["ask_participant"]


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
