"""Experiments in the participant's browser, with the laboratory's designs, trial orders, records and checks.

A server sends the trial list of a design and writes the same journals; the page in the browser shows the trials and
asks for responses. No other subpackage imports the server's libraries (extra `web`).
"""

from focalgradient.design.consent import Consent
from focalgradient.web.application import application, page_is_built, run
from focalgradient.web.collect import Collected, LeftOut, collect
from focalgradient.web.export import export
from focalgradient.web.guard import Limits
from focalgradient.web.lists import Lists
from focalgradient.web.people import People
from focalgradient.web.study import Study

__all__ = [
    "Collected",
    "Consent",
    "LeftOut",
    "Limits",
    "Lists",
    "People",
    "Study",
    "application",
    "collect",
    "export",
    "page_is_built",
    "run",
]
