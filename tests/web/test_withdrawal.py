"""After somebody has withdrawn nothing names them: not in the data set, the file of links, or the database."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import participant
import pytest
from command_line import succeed
from databases import Cluster
from participant import NECKER, PASSWORD, Participant, client_of, kept_in, study
from starlette.testclient import TestClient

from focalgradient import InputError
from focalgradient.dataset import validate, withdraw
from focalgradient.dataset.links import forget_links, links_beside, read_links
from focalgradient.web import People

PLATFORM = {"PROLIFIC_PID": "5f1e4c0d9b", "SESSION_ID": "session-17", "STUDY_ID": "study-4"}
TRIALS = 8
"""Of a session of `NECKER`."""


@pytest.fixture
def address(databases: Cluster, monkeypatch: pytest.MonkeyPatch) -> str:
    """Of a database in which the studies are kept."""
    found = databases.address()
    monkeypatch.setattr(participant, "DATABASE", [found])
    return found


def names_of(folder: Path, token: str, label: str = "002") -> list[bytes]:
    """All that names somebody who takes part: read before they withdraw."""
    identifiers = [token, hashlib.sha256(token.encode()).hexdigest(), *PLATFORM.values(), f"sub-{label}", f'"{label}"']
    chains: list[str] = []
    for path in folder.rglob(f"sub-{label}_*.jsonl"):
        for line in path.read_text().splitlines():
            event = json.loads(line)
            chains += [one for one in event["chain"] if one] + ([event["record"]] if "record" in event else [])
    return [one.encode() for one in identifiers + chains]


def found_in(folder: Path, names: list[bytes]) -> list[tuple[str, bytes]]:
    """Which of these stand in a file, or the name of one, that is left below a folder."""
    found = []
    for path in folder.rglob("*"):
        content = path.name.encode() + (path.read_bytes() if path.is_file() else b"")
        found += [(str(path), name) for name in names if name in content]
    return found


def take_part(client: TestClient, platform: dict[str, str] | None = None, answers: int = 2) -> Participant:
    """Somebody joins, begins and answers; the tab is closed."""
    someone = Participant(client, client.post("/api/join", json={"platform": platform or {}}).json()["token"])
    someone.begin()
    for number in range(answers):
        assert someone.answer(number).status_code == 200
    if answers == len(someone.trials) == TRIALS:
        someone.ask("finish")
    return someone


@pytest.mark.parametrize("ended", [True, False], ids=["ended", "open"])
def test_a_participant_who_withdraws_is_named_nowhere(tmp_path: Path, ended: bool) -> None:
    (tmp_path / "study").mkdir()
    with client_of(study(tmp_path / "study")) as client:
        first = take_part(client)
        someone = take_part(client, PLATFORM, TRIALS if ended else 1)
        names = names_of(tmp_path / "study", someone.token)
        assert len(found_in(tmp_path / "study", names)) > 5
        assert someone.ask("withdraw").status_code == 200
        assert found_in(tmp_path / "study", names) == []
        assert someone.ask("withdraw").status_code == 404
        assert first.answer(2).json()["done"] == 3  # goes on
    with client_of(study(tmp_path / "study")) as client:
        assert found_in(tmp_path / "study", names) == []
        assert Participant(client, someone.token).ask("state").status_code == 404
        back = take_part(client, PLATFORM, 1)  # comes back as somebody new
        rows = client.get("/experimenter/overview.json", auth=("experimenter", PASSWORD)).json()["participants"]
        assert [row["participant"] for row in rows] == ["001", "003"]
        assert not any(row["same_identifier"] for row in rows)
        assert back.ask("state").json()["done"] == 1


@pytest.mark.parametrize("runs", [True, False], ids=["while the server runs", "afterwards"])
def test_who_is_withdrawn_is_named_nowhere(tmp_path: Path, runs: bool) -> None:
    (tmp_path / "design.toml").write_text(NECKER)
    made = study(tmp_path)
    made.people.close()
    made.people = People(tmp_path / "data-links.jsonl", data=tmp_path / "data")

    def act() -> None:
        done = succeed("withdraw", tmp_path / "data", "sub-002")
        assert f"Removed from: {tmp_path / 'data-links.jsonl'}" in done.output

    with client_of(made) as client:
        first, someone = take_part(client), take_part(client, PLATFORM, TRIALS)
        names = names_of(tmp_path, someone.token)
        if runs:
            act()
            assert someone.ask("state").status_code == 404
            assert someone.begin().status_code == 404
            assert first.answer(2).json()["done"] == 3
            assert made.people.of(take_part(client, PLATFORM, 1).token).participant == "003"  # type: ignore[union-attr]
            names = [name for name in names if name.decode() not in PLATFORM.values()]  # who came back
    if not runs:
        act()
    assert found_in(tmp_path, names) == []
    people = People(tmp_path / "data-links.jsonl", frozenset({"001"}))
    assert people.of(people.join({})).participant == ("004" if runs else "003")  # type: ignore[union-attr]
    people.close()
    with pytest.raises(InputError, match="has no participant sub-002"):
        withdraw(tmp_path / "data", "002")


@pytest.mark.parametrize("name", [".", "../data", "data/."])
def test_the_links_beside_a_folder_are_found_whatever_it_is_called(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    (tmp_path / "data").mkdir()
    monkeypatch.chdir(tmp_path if name == "data/." else tmp_path / "data")
    assert links_beside(Path(name)).resolve() == tmp_path.resolve() / "data-links.jsonl"


def test_a_second_tab_does_not_withdraw_what_the_first_shows(tmp_path: Path) -> None:
    with client_of(study(tmp_path)) as client:
        someone = take_part(client)
        other = Participant(client, someone.token, "tab-2")
        assert other.ask("withdraw").status_code == 409
        assert someone.answer(2).json()["done"] == 3
        someone.ask("leave")
        assert other.ask("withdraw").status_code == 200


def test_who_was_stopped_can_withdraw(tmp_path: Path) -> None:
    made = study(tmp_path)
    with client_of(made) as client:
        someone = take_part(client)
        made.stop("001")
        assert someone.ask("withdraw").status_code == 200
        assert someone.ask("state").status_code == 404
    assert found_in(tmp_path, names_of(tmp_path, someone.token, "001")) == []


def test_overwriting_that_was_cut_off_is_ended_by_the_next_server(tmp_path: Path) -> None:
    links = tmp_path / "links.jsonl"
    people = People(links)
    tokens = [people.join(PLATFORM), people.join({"id": "2"})]
    whole = links.read_bytes()
    people.forget("001")
    people.close()
    redacted = links.read_bytes()
    assert len(redacted) == len(whole)
    line = whole.index(b"\n")
    for cut in range(1, line):
        for torn in (redacted[:cut] + whole[cut:], whole[:cut] + redacted[cut:]):
            links.write_bytes(torn)
            found = read_links(links)
            if [link.participant for link in found.links] == ["001", "002"]:
                continue  # nothing is overwritten yet
            again = People(links)
            assert again.of(tokens[1]).participant == "002"  # type: ignore[union-attr]
            again.close()
            assert PLATFORM["PROLIFIC_PID"].encode() not in links.read_bytes(), cut


@pytest.mark.parametrize("kept", [1, 20, 30, 36, 37, 40])
def test_what_a_full_disk_cut_off_is_overwritten_however_short_it_is(tmp_path: Path, kept: int) -> None:
    links = tmp_path / "links.jsonl"
    people = People(links)
    people.join({"id": "1"})
    people.close()
    whole = links.read_bytes()
    torn = b'{"participant": "002", "sha256": "0123456789"}'[:kept]
    links.write_bytes(whole + torn)
    assert forget_links(links) == 1
    after = links.read_bytes()
    assert after[: len(whole)] == whole
    assert len(after) == len(whole) + kept
    # what follows the whole lines says nothing of anybody: spaces, or the marked place of nobody
    assert after[len(whole) :].rstrip() in (b"", b'{"participant": null, "labels": 1}')
    assert [link.participant for link in read_links(links).links] == ["001"]


@pytest.mark.parametrize("line", [b'{"participant": 5, "stopped": true}', b'{"participant": "002"}', b"[]", b"002"])
def test_what_is_whole_but_no_link_is_refused_and_not_overwritten(tmp_path: Path, line: bytes) -> None:
    links = tmp_path / "links.jsonl"
    people = People(links)
    people.join({"id": "1"})
    people.close()
    whole = links.read_bytes() + line + b"\n"
    links.write_bytes(whole)
    for act in (read_links, forget_links):
        with pytest.raises(InputError, match=r"links\.jsonl, line 2, is not a link: give a file of links"):
            act(links)
    assert links.read_bytes() == whole


def columns(address: str) -> bytes:
    """All columns of all tables of a study's schema."""
    import psycopg

    schema = address.rpartition("%3D")[2]
    with psycopg.connect(address) as connection:
        tables = connection.execute("select tablename from pg_tables where schemaname = %s", [schema]).fetchall()
        rows = [connection.execute(f"select t::text from {table} t").fetchall() for (table,) in tables]  # type: ignore[call-overload]
    return json.dumps(rows).replace("\\", "").encode()


def collected(address: str, folder: Path) -> None:
    succeed("collect", "--store", address, "--data", folder)


@pytest.mark.parametrize("way", ["page", "command"])
def test_in_a_database_and_what_was_collected_of_it_nothing_names_them(address: str, tmp_path: Path, way: str) -> None:
    (tmp_path / "servers").mkdir()
    (tmp_path / "servers" / "design.toml").write_text(NECKER)
    one, other = kept_in(address, tmp_path / "servers"), kept_in(address, tmp_path / "servers")
    with client_of(one) as first, client_of(other) as second:
        goes_on, someone = take_part(first), take_part(first, PLATFORM)
        someone.client = second
        assert someone.answer(2).status_code == 200  # so that both servers know the session
        names = names_of(tmp_path / "servers", someone.token)
        names.remove(b'"002"')  # which may stand for another number in a journal
        collected(address, tmp_path / "data")
        assert found_in(tmp_path / "data", names) != []
        assert all(name in columns(address) for name in names if name != b"sub-002" and name != names[0])
        if way == "page":
            assert someone.ask("withdraw").status_code == 200
        else:
            done = succeed("withdraw", tmp_path / "none", "sub-002", "--store", address, "--yes")
            assert "Removed from the store." in done.output
        for client in (first, second):
            someone.client = client
            assert someone.ask("state").status_code == 404
            assert someone.begin().status_code == 404
            assert client.get("/experimenter/overview.json", auth=("experimenter", PASSWORD)).status_code == 200
        assert goes_on.answer(2).json()["done"] == 3
        assert [name for name in names if name in columns(address)] == []
        assert found_in(tmp_path / "servers", names) == []
        collected(address, tmp_path / "data")
        assert found_in(tmp_path / "data", names) == []
        token = second.post("/api/join", json={"platform": PLATFORM}).json()["token"]
        assert other.people.of(token).participant == "003"  # type: ignore[union-attr]


def test_who_was_removed_from_the_collected_data_alone_does_not_come_back(address: str, tmp_path: Path) -> None:
    with client_of(study(tmp_path)) as client:
        take_part(client)
        collected(address, tmp_path / "collected")
        withdraw(tmp_path / "collected", "001")
        collected(address, tmp_path / "collected")
    assert not list((tmp_path / "collected").rglob("sub-001*"))
    assert validate(tmp_path / "collected").notes == ("1 participant withdrew; the data were removed.",)
