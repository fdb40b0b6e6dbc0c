"""Export of a study as a folder of files, for platforms that store responses: JATOS, DataPipe, Pavlovia.

The page is the server's. Trial lists are generated at export: a label and a seed determine the list, wherever it is
run.
"""

from __future__ import annotations

import hashlib
import html
import json
import re
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from focalgradient.errors import InputError
from focalgradient.files import existing, printable, staged
from focalgradient.tasks import task_named
from focalgradient.web.lists import Lists, check_completion, digest_of
from focalgradient.web.pictures import FILM, PNG, REFOCUSING, parts, refocusing

__all__ = ["PLATFORMS", "export", "labels_of"]

PLATFORMS = {"jatos": "jatos.html", "datapipe": "datapipe.html", "pavlovia": "index.html"}
"""Page of each platform. Pavlovia opens index.html."""

CONNECT = {"datapipe": " https://pipe.jspsych.org", "pavlovia": " https://pavlovia.org https://*.pavlovia.org"}
"""Addresses to which responses are sent, in addition to the page's own."""

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "connect-src 'self'{connect}; base-uri 'none'; form-action 'none'"
)
"""Content security policy, as for the server's page. JATOS gets none, so that its own script works in every version."""


REVEALS = (
    "A page without a server has all trials of a participant, and judges practice itself: each list contains the "
    "order, the correct responses to practice and the debriefing, and study.json the design with its seed, from which "
    "all conditions follow. Pictures are named by their content and differ in size."
)
"""What a participant who opens the files of an exported study can learn; stated in each list."""


def labels_of(participants: str) -> list[str]:
    """Return the labels of participants 1 to N, or A to B for "A-B", as the server would assign them.

    >>> labels_of("101-103")
    ['101', '102', '103']
    """
    found = re.fullmatch(r"(?:([0-9]{1,5})-)?([0-9]{1,5})", participants)
    first, last = (int(found[1] or 1), int(found[2])) if found else (0, 0)
    if not 1 <= first <= last < first + 10_000:
        raise InputError(
            f"participants is {participants!r}, but must be a number up to 10000, or a range such as 101-150."
        )
    return [f"{number:03}" for number in range(first, last + 1)]


def export(
    lists: Lists,
    folder: Path,
    labels: Sequence[str],
    *,
    completion: str | None = None,
    datapipe: str | None = None,
) -> int:
    """Write a study as a folder of files.

    Parameters
    ----------
    lists
        Design with its texts, pictures and trial lists.
    folder
        Destination: new or empty.
    labels
        Labels of the participants, each with its own trial list.
    completion
        Address to which participants are redirected at the end.
    datapipe
        Experiment ID at DataPipe, if known.

    Returns
    -------
    int
        Number of pictures copied.

    Raises
    ------
    InputError
        If the folder is not empty, or cannot be written, or an address or ID is invalid.
    """
    check_completion(completion)
    if datapipe is not None and not re.fullmatch(r"[A-Za-z0-9_-]{1,64}", datapipe):
        raise InputError(f"datapipe is {datapipe!r}, but must be an ID of letters and digits.")
    if task_named(lists.design.task).adapts:
        raise InputError(
            f"{lists.design.task} is adaptive and needs a server: use focalgradient "
            "serve, or give a fixed list of trials."
        )
    _check_free(folder)
    try:
        with staged(existing(folder.absolute().parent)) as hidden:
            bundle = hidden / "bundle"
            bundle.mkdir()
            shown = _write_lists(lists, bundle, labels)
            _write_study(lists, bundle, labels, completion)
            _write_pages(bundle, datapipe)
            folder.parent.mkdir(parents=True, exist_ok=True)
            if folder.is_dir():
                folder.rmdir()
            bundle.rename(folder)
    except OSError as error:
        raise InputError(
            f"{printable(folder)} cannot be written ({error.strerror or error}): give a folder that can."
        ) from error
    return len(shown)


def _check_free(folder: Path) -> None:
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise InputError(f"{printable(folder)} exists and is not a folder: give a new folder.")
    if folder.is_dir() and any(folder.iterdir()):
        raise InputError(f"{printable(folder)} contains files: give a new or an empty folder.")


def _write_lists(lists: Lists, bundle: Path, labels: Sequence[str]) -> set[str]:
    """Write all trial lists; return the names of the pictures that they show."""
    (bundle / "lists").mkdir()
    shown: set[str] = set()
    for label in labels:
        trials = lists.design.trials(label)
        entries = lists.shown(label, trials)
        for entry, trial in zip(entries, trials, strict=True):
            for part, file in zip(parts(entry), lists.contents(label, trial), strict=True):
                part["url"] = _write_picture(bundle, shown, file)
            for step in (*entry["first"], *entry["before"], *entry["lead"]):
                if interval := step.get("standard"):
                    interval["url"] = _write_picture(bundle, shown, lists.standard())
            if trial.phase == "practice":
                entry |= lists.key(label, trial)
        design: Any = lists.design
        judged = {
            name: getattr(design, name, value) for name, value in (("practice_right", 0.0), ("practice_rounds", 1))
        }
        content = {
            "reveals": REVEALS,
            "sha256": digest_of(trials),
            "session": lists.session(label) | judged | {"again": lists.again(label), "closing": lists.closing(label)},
            "trials": entries,
        }
        (bundle / "lists" / f"{label}.json").write_text(json.dumps(content), encoding="utf-8")
    return shown


def _write_picture(bundle: Path, shown: set[str], content: bytes | None) -> str:
    """Write a picture, once, under a name that only its content determines; return its address."""
    assert content is not None
    kind = {PNG[:1]: "png", FILM: "film"}.get(content[:1], "json")
    name = f"{hashlib.sha256(content).hexdigest()[:32]}.{kind}"
    if name not in shown:
        (bundle / "pictures").mkdir(exist_ok=True)
        (bundle / "pictures" / name).write_bytes(content)
        shown.add(name)
    return f"pictures/{name}"


def _write_study(lists: Lists, bundle: Path, labels: Sequence[str], completion: str | None) -> None:
    content = {
        "opening": lists.opening(),
        "design": lists.design.model_dump(mode="json"),
        "stimuli": lists.manifest and lists.manifest.sha256,
        "labels": list(labels),
        "completion": completion,
    }
    content["id"] = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
    (bundle / "study.json").write_text(json.dumps(content), encoding="utf-8")


def _write_pages(bundle: Path, datapipe: str | None) -> None:
    static = files("focalgradient.web") / "static"
    for name in ("page.js", "page.css"):
        (bundle / name).write_bytes((static / name).read_bytes())
    (bundle / REFOCUSING).write_bytes(refocusing())
    page = (static / "index.html").read_text(encoding="utf-8").replace("/static/", "")
    for platform, name in PLATFORMS.items():
        policy = html.escape(POLICY.format(connect=CONNECT.get(platform, "")), quote=False)
        head = f'<meta http-equiv="Content-Security-Policy" content="{policy}" />'
        if platform == "jatos":
            head = '<script src="jatos.js"></script>'
        body = f'<body id="stage" data-platform="{platform}">'
        if platform == "datapipe":
            body = body.replace(">", f' data-experiment="{html.escape(datapipe or "")}">')
        made = page.replace("    <title>", f"    {head}\n    <title>").replace('<body id="stage">', body)
        assert head in made
        assert body in made
        (bundle / name).write_text(made, encoding="utf-8")
    how = (files("focalgradient.web") / "HOW-TO.txt").read_text(encoding="utf-8")
    (bundle / "HOW-TO.txt").write_text(how, encoding="utf-8")
