"""Who can do what to a participant's session: every cell of the table in docs/web.md, with both stores."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import participant
import pytest
from participant import PASSWORD, SITTING, Participant, client_of, study
from starlette.testclient import TestClient

from focalgradient.dataset import read_journal

pytestmark = pytest.mark.usefixtures("store")

DOCS = Path(__file__).parents[2] / "docs" / "web.md"
IDENTIFIER = {"PROLIFIC_PID": "5f1e4c0d9b", "id": "1"}
SECRET = "a-secret-of-the-participants-browser"
ELSEWHERE: tuple[dict[str, str], ...] = ({"Origin": "https://evil.example"}, {"Sec-Fetch-Site": "cross-site"})
"""Headers of pages of other sites: `test_guard` has more of them."""


def cells() -> list[tuple[str, str, str]]:
    """Row, column and content of each cell."""
    lines = DOCS.read_text().split("## Access rights\n\n")[1].splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")][:12]
    header, _, *body = rows
    return [(row[0], column, cell) for row in body for column, cell in zip(header[1:], row[1:], strict=True)]


CELLS = cells()


def test_the_table_has_every_actor_and_act() -> None:
    assert {column for _, column, _ in CELLS} == set(ACTS)
    assert {row for row, _, _ in CELLS} == set(ACTORS)


class Actor:
    """Somebody with something: what is sent, in place of what is not known."""

    def __init__(self, client: TestClient, victim: Participant, **known: Any):
        self.client, self.victim = client, victim
        self.headers: dict[str, str] = known.get("headers", {})
        self.auth = known.get("auth")
        self.platform: dict[str, str] = known.get("platform", {})
        self.tab = known.get("tab", victim.tab)
        self.secret: str | None = known.get("secret")

    def post(self, path: str, **message: Any) -> Any:
        return self.client.post(path, json=message, headers=self.headers, auth=self.auth)

    def tokens(self) -> list[str]:
        """What may be tried as a secret: that which is known, or else what joining gives and what can be guessed."""
        if self.secret is not None:
            return [self.secret]
        joined = self.join().json().get("token", "x")
        return [joined, "001", "sub-001", *IDENTIFIER.values()]

    def join(self) -> Any:
        secret = {} if self.secret is None else {"secret": self.secret}
        return self.post("/api/join", platform=self.platform, **secret)

    def act(self, path: str, **message: Any) -> list[Any]:
        return [self.post(f"/api/{path}", token=token, tab=self.tab, **message) for token in self.tokens()]


OWN = {"platform": IDENTIFIER, "secret": SECRET}
ACTORS: dict[str, list[dict[str, Any]]] = {
    "nothing (`--no-open-link`)": [{}],
    "the open link": [{}],
    "the open link and a participant's identifier": [{"platform": IDENTIFIER}, {"platform": {"id": "1"}}],
    "the open link, identifier and label": [{"platform": {**IDENTIFIER, "participant": "001", "label": "sub-001"}}],
    "the participant's own link or secret": [OWN],
    "the same, in a second tab meanwhile": [{**OWN, "tab": "tab-2"}],
    "the same, from a page of another site": [],
    "the experimenter's password": [{"auth": ("experimenter", PASSWORD)}],
    "a guessed password": [{"auth": ("experimenter", guess)} for guess in ("", PASSWORD + " ")],
}
FROM_ELSEWHERE: dict[bool, list[dict[str, Any]]] = {
    False: [{**OWN, "headers": headers} for headers in ELSEWHERE],
    True: [{"auth": ("experimenter", PASSWORD), "headers": headers} for headers in ELSEWHERE],
}


def known_by(row: str, number: int) -> list[dict[str, Any]]:
    """What the actors of a row have; the second row 'from a page of another site' is the experimenter's."""
    if "another site" not in row:
        return ACTORS[row]
    return FROM_ELSEWHERE[number > [one for one, _, _ in CELLS].index("the experimenter's password")]


def joining(actor: Actor, cell: str) -> None:
    reply = actor.join()
    if cell == "no":
        assert reply.status_code == 403
        return
    assert reply.status_code == 200
    assert (reply.json()["token"] == SECRET) == (cell == "same")
    rows = overview(actor.client)
    assert len(rows) == (1 if cell == "same" else 2)
    assert all(row["same_identifier"] == (cell == "new, noted") for row in rows)


def reading(actor: Actor, cell: str) -> None:
    replies = [reply.json() for reply in actor.act("state")]
    statuses = {reply.get("status") for reply in replies}
    # Who is not refused reads of the own, new session alone.
    assert statuses <= {"yes": {"begun"}, "busy": {"busy"}, "no": {None, "new"}}[cell]
    assert all(reply.get("done") in ((1,) if cell in ("yes", "busy") else (None, 0)) for reply in replies)


def going_on(actor: Actor, cell: str) -> None:
    replies = actor.act("begin", **SITTING)
    total = len(actor.victim.trials)
    assert any(reply.status_code == 200 and len(reply.json()["trials"]) == total - 1 for reply in replies) == (
        cell == "yes"
    )
    assert actor.victim.answer(1).status_code == 200  # as before


def answering(actor: Actor, cell: str) -> None:
    message = actor.victim.message(actor.victim.trials[1], 1)
    token = actor.victim.trial_token(message)  # known to all: it opens no session
    key = {name: message[name] for name in ("phase", "trial")}
    shown = actor.act("expose", **key, round=1, exposure="exposure")
    replies = actor.act("answer", **message, trial_token=token)
    assert any(reply.status_code == 200 for reply in shown) == (cell == "yes")
    assert any(reply.status_code == 200 for reply in replies) == (cell == "yes")
    assert actor.victim.ask("state").json()["done"] == (2 if cell == "yes" else 1)


def withdrawing(actor: Actor, cell: str) -> None:
    actor.act("withdraw")
    assert actor.victim.ask("state").status_code == (404 if cell == "yes" else 200)
    if cell == "no":
        assert actor.victim.answer(1).json()["done"] == 2


def stopping(actor: Actor, cell: str) -> None:
    reply = actor.post("/experimenter/stop/001")
    assert reply.status_code in ((200,) if cell == "yes" else (401, 403))
    assert actor.victim.ask("state").json()["status"] == ("stopped" if cell == "yes" else "begun")


def looking(*paths: str) -> Callable[[Actor, str], None]:
    def look(actor: Actor, cell: str) -> None:
        for path in paths:
            reply = actor.client.get(path, headers=actor.headers, auth=actor.auth)
            assert reply.status_code == (200 if cell == "yes" else 401)

    return look


ACTS: dict[str, Callable[[Actor, str], None]] = {
    "join": joining,
    "read the state": reading,
    "go on": going_on,
    "answer": answering,
    "withdraw": withdrawing,
    "stop": stopping,
    "download": looking("/experimenter/data.zip"),
    "experimenter's page": looking("/experimenter", "/experimenter/overview.json"),
}


def overview(client: TestClient) -> list[dict[str, Any]]:
    return list(client.get("/experimenter/overview.json", auth=("experimenter", PASSWORD)).json()["participants"])


@pytest.mark.fast_cases(60)
@pytest.mark.parametrize("number", range(len(CELLS)), ids=[f"{column}, {row}" for row, column, _ in CELLS])
def test_each_cell(tmp_path: Path, number: int) -> None:
    row, column, cell = CELLS[number]
    for place, known in enumerate(known_by(row, number)):
        folder = tmp_path / str(place)
        folder.mkdir()
        if participant.DATABASE and place:
            return  # a database has one study; what else is tried is tried with the folder
        made = study(folder)
        with client_of(made) as client:
            joined = client.post("/api/join", json={"platform": IDENTIFIER, "secret": SECRET})
            victim = Participant(client, joined.json()["token"])
            victim.begin()
            victim.answer(0)
            made.open_link = "no-open-link" not in row
            ACTS[column](Actor(client, victim, **known), cell)


def test_the_second_with_an_identifier_is_named_by_validate_and_the_first_goes_on(tmp_path: Path) -> None:
    with client_of(study(tmp_path)) as client:
        honest = Participant(client, client.post("/api/join", json={"platform": {"id": "1"}}).json()["token"])
        honest.begin()
        other = Participant(client, client.post("/api/join", json={"platform": {"id": "1"}}).json()["token"])
        other.begin()
        assert honest.answer(0).json()["done"] == 1
        assert [row["same_identifier"] for row in overview(client)] == [True, True]
        journals = sorted((tmp_path).rglob("sub-*_beh.jsonl"))
        kinds = [[note["kind"] for note in read_journal(journal).of("note")] for journal in journals]
        assert ["same identifier" in one for one in kinds] == [False, True]
        other.ask("withdraw")
        assert [row["same_identifier"] for row in overview(client)] == [False]
        assert honest.answer(1).json()["done"] == 2
