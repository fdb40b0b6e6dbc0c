"""Experiments in the participant's browser, with the laboratory's designs, trial orders, records and checks.

A server sends the trial list of a design and writes the same journals; the page in the browser shows the trials and
asks for responses. No other subpackage imports the server's libraries (extra `web`).
"""

from focalgradient.design.consent import Consent
from focalgradient.web.application import application, check_page, run
from focalgradient.web.collect import Collected, LeftOut, collect
from focalgradient.web.export import REVEALS, export, labels_of
from focalgradient.web.guard import Limits
from focalgradient.web.lists import Lists
from focalgradient.web.opening import browser_design, open_shared_study, open_study
from focalgradient.web.people import People
from focalgradient.web.study import Study

__all__ = [
    "REVEALS",
    "Collected",
    "Consent",
    "LeftOut",
    "Limits",
    "Lists",
    "People",
    "Study",
    "application",
    "browser_design",
    "check_page",
    "collect",
    "export",
    "labels_of",
    "open_shared_study",
    "open_study",
    "run",
]
