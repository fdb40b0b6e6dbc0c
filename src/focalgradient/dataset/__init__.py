"""Data sets of the experiments: crash-safe journals, BIDS files derived from them, reading and validation."""

from focalgradient.dataset.answers import Answer, Apparatus, Chosen, Noted, Rated, Response, Watched, answer_event
from focalgradient.dataset.bids import Files, Kind, begin_dataset, export, journals
from focalgradient.dataset.checks import Findings, checking, validate
from focalgradient.dataset.journal import Journal, Log, read_journal
from focalgradient.dataset.mend import Repair, repair
from focalgradient.dataset.percepts import Percept, Press, Seen, percepts
from focalgradient.dataset.read import DataSet, read_dataset
from focalgradient.dataset.session import Session
from focalgradient.dataset.stimuli import Manifest, check_stimuli
from focalgradient.dataset.validator import VALIDATOR, bids_problems, checking_bids
from focalgradient.dataset.withdrawal import withdraw

__all__ = [
    "VALIDATOR",
    "Answer",
    "Apparatus",
    "Chosen",
    "DataSet",
    "Files",
    "Findings",
    "Journal",
    "Kind",
    "Log",
    "Manifest",
    "Noted",
    "Percept",
    "Press",
    "Rated",
    "Repair",
    "Response",
    "Seen",
    "Session",
    "Watched",
    "answer_event",
    "begin_dataset",
    "bids_problems",
    "check_stimuli",
    "checking",
    "checking_bids",
    "export",
    "journals",
    "percepts",
    "read_dataset",
    "read_journal",
    "repair",
    "validate",
    "withdraw",
]
