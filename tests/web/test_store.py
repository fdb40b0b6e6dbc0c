"""Journals in PostgreSQL behind several servers: nothing is lost between them, and the data set is the same."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import run, sentence, succeed
from databases import FOUND, Cluster
from participant import DEPTH, NECKER, Participant, client_of, kept_in, make_set

from focalgradient import InputError
from focalgradient.dataset import read_journal, validate
from focalgradient.web.study import Study

pytestmark = pytest.mark.skipif(FOUND is None, reason="PostgreSQL is missing: install the Debian package postgresql")


def two(address: str, folder: Path, design: str = NECKER) -> tuple[Study, Study]:
    """Two servers of one study."""
    folder.mkdir(exist_ok=True)
    (folder / "design.toml").write_text(design)
    options = {}
    if design == DEPTH:
        options["stimuli"] = folder / "set"
        make_set(folder / "set", ["spheres-00", "spheres-01", "spheres-02"], size=(320, 241))
    return kept_in(address, folder, **options), kept_in(address, folder, **options)


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("design", [NECKER, DEPTH], ids=["necker", "depthrating"])
def test_each_request_may_reach_another_server(databases: Cluster, tmp_path: Path, design: str) -> None:
    address = databases.address()
    one, other = two(address, tmp_path, design)
    with client_of(one) as first, client_of(other) as second:
        servers = [first, second]
        someone = Participant(first)
        someone.client = second
        assert someone.begin().status_code == 200
        for number in range(len(someone.trials)):
            someone.client = servers[number % 2]
            assert someone.answer(number).json() == {"recorded": True, "done": number + 1}
            someone.client = servers[(number + 1) % 2]
            assert someone.answer(number).json()["again"]
        assert someone.ask("finish").status_code == 200
        assert first.get("/experimenter/data.zip").status_code == 401
        words = ("collect", "--store", address, "--data", tmp_path / "set-of-data")
        assert "Sessions in" in succeed(*words).output
        again = run(*words)
        assert "sub-001: 0 new lines" in again.output
    found = validate(tmp_path / "set-of-data", tmp_path / "set" if design == DEPTH else None)
    assert found.problems == ()
    log = read_journal(next((tmp_path / "set-of-data").rglob("*.jsonl")))
    assert [(trial["phase"], trial["trial"]) for trial in log.of("trial")] == [
        (trial.phase, trial.trial) for trial in one.design.trials("001")
    ]
    assert log.of("resumed") == []  # one sitting, whoever served it


def test_the_tab_and_a_stop_are_known_to_all_servers(databases: Cluster, tmp_path: Path) -> None:
    one, other = two(databases.address(), tmp_path)
    with client_of(one) as first, client_of(other) as second:
        someone = Participant(first)
        someone.begin()
        elsewhere = Participant(second, someone.token, "tab-2")
        assert elsewhere.ask("state").json()["status"] == "busy"
        assert elsewhere.begin().status_code == 409
        someone.ask("leave")
        assert elsewhere.begin().status_code == 200
        assert someone.answer(0).status_code == 409
        other.stop("001")
        assert someone.ask("state").json()["status"] == "stopped"
        assert elsewhere.answer(0).status_code == 410


def test_a_database_that_goes_away_is_waited_for(databases: Cluster, tmp_path: Path) -> None:
    address = databases.address()
    one, other = two(address, tmp_path)
    other.close()
    with client_of(one) as client:
        someone = Participant(client)
        someone.begin()
        someone.answer(0)
        databases.stop()
        try:
            assert someone.answer(1).status_code == 503
            assert someone.answer(1).status_code == 503
        finally:
            databases.start()
        replies = [someone.answer(1) for _ in range(10)]  # each connection that was lost is found to be so once
        assert replies[-1].json()["recorded"]
        assert someone.answer(2).json()["done"] == 3
        succeed("collect", "--store", address, "--data", tmp_path / "got")
    keys = [
        (event["phase"], event["trial"])
        for event in read_journal(next((tmp_path / "got").rglob("*.jsonl"))).of("trial")
    ]
    assert keys == [(trial.phase, trial.trial) for trial in one.design.trials("001")][:3]


def test_a_database_holds_one_study(databases: Cluster, tmp_path: Path) -> None:
    address = databases.address()
    for served in two(address, tmp_path / "a"):
        served.close()
    with pytest.raises(InputError, match="a study with another design"):
        two(address, tmp_path / "b", NECKER.replace("4.0", "5.0"))


@pytest.mark.parametrize(
    "options",
    [
        ["serve", "design.toml", "--store", "mysql://x/y"],
        ["serve", "design.toml", "--store", "postgresql://nobody@127.0.0.1:9/x"],
        ["serve", "design.toml", "--store", "postgresql://a@b/c", "--data", "data"],
        ["collect", "--store", "postgresql://nobody@127.0.0.1:9/x", "--data", "data"],
        ["collect", "--data", "data"],
    ],
)
def test_an_address_that_is_none_is_refused_in_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: list[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "design.toml").write_text(NECKER)
    sentence(run(*options))
    assert not (tmp_path / "data").exists()
