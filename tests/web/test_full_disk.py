"""A server on a disk that fills up: who joins is refused in a sentence, and the file of links stays whole."""

from __future__ import annotations

from pathlib import Path

import pytest
from participant import PASSWORD, Participant, client_of, study
from small_disk import limit_disk

from focalgradient.dataset.links import read_links
from focalgradient.web import Limits, People

PLATFORM = {"PROLIFIC_PID": "5f1e4c0d9b", "SESSION_ID": "s-1"}


@pytest.mark.parametrize("truncates", [True, False], ids=["cut back", "left cut short"])
def test_who_joins_at_each_byte_that_is_left_is_refused_and_not_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, truncates: bool
) -> None:
    links = tmp_path / "links.jsonl"
    with client_of(study(tmp_path), Limits(joins=1000)) as client:
        first = client.post("/api/join", json={"platform": PLATFORM}).json()["token"]
        length = links.stat().st_size
        tokens = [first]
        for room in range(0, length, 1 if truncates else 7):
            with monkeypatch.context() as disk:
                limit_disk(disk, room, truncates=truncates)
                reply = client.post("/api/join", json={"platform": PLATFORM})
            assert reply.status_code == 503
            assert reply.json() == {"error": "The server cannot write at the moment."}
            assert reply.headers["retry-after"] == "5"
            if truncates:
                assert links.stat().st_size == length
        tokens.append(client.post("/api/join", json={"platform": PLATFORM}).json()["token"])
        assert [Participant(client, token).ask("state").json()["status"] for token in tokens] == ["new", "new"]
    again = People(links)
    assert [again.of(token).participant for token in tokens] == ["001", "002"]  # type: ignore[union-attr]
    again.close()
    assert len(read_links(links).links) == 2
    assert read_links(links).torn == []


def test_a_secret_that_was_refused_is_taken_when_there_is_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    message = {"platform": PLATFORM, "secret": "a-secret-of-the-participants-browser"}
    with client_of(study(tmp_path)) as client:
        with monkeypatch.context() as disk:
            limit_disk(disk, 40)
            assert client.post("/api/join", json=message).status_code == 503
        for _ in range(2):
            assert client.post("/api/join", json=message).json() == {"token": message["secret"]}
        rows = client.get("/experimenter/overview.json", auth=("experimenter", PASSWORD)).json()["participants"]
    assert [row["participant"] for row in rows] == ["001"]


def test_no_address_answers_with_an_error_of_the_servers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with client_of(study(tmp_path)) as client:
        someone = Participant(client)
        someone.begin()
        someone.show(someone.trials[0])
        new = Participant(client)
        with monkeypatch.context() as disk:
            limit_disk(disk, 0)
            reply = someone.answer(0)
            assert reply.status_code == 503  # the page keeps the answer and asks again
            assert str(tmp_path) not in reply.text
            assert new.begin().status_code == 503
            assert client.post("/experimenter/stop/001", auth=("experimenter", PASSWORD)).status_code == 503
        assert someone.answer(0).json()["done"] == 1
        assert new.begin().status_code == 200
