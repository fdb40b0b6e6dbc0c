"""What a server needs before anybody takes part: pictures, a password, a folder and a page of its own."""

from __future__ import annotations

import os
import shutil
import sys
from importlib.resources import files
from pathlib import Path

import pytest
from command_line import run, sentence
from participant import NECKER

from focalgradient import InputError
from focalgradient.design import load_design
from focalgradient.design.given_list import trial_row
from focalgradient.web import Lists, People, check_page


def test_a_list_with_a_number_that_is_not_finite_starts_no_server(tmp_path: Path) -> None:
    path = tmp_path / "design.toml"
    path.write_text(NECKER)
    design = load_design(path)
    rows = tuple(
        {key: value for key, value in trial_row(trial).items() if key not in ("trial", "repetition")}
        | {"trial_s": float("nan")}
        for trial in design.trials("01")
    )
    with pytest.raises(InputError, match=r"trial 1 of participant 001 has a number that is not finite"):
        Lists(design.model_copy(update={"given_trials": rows}))


def test_links_belong_to_one_server_and_are_whole(tmp_path: Path) -> None:
    path = tmp_path / "links.jsonl"
    people = People(path)
    tokens = people.invite(3)
    with pytest.raises(InputError, match="another server uses"):
        People(path)
    people.close()
    path.write_bytes(path.read_bytes() + b'{"participant": "00')  # cut short by a kill
    again = People(path)
    assert [again.of(token).participant for token in tokens] == ["001", "002", "003"]  # type: ignore[union-attr]
    assert again.of("x") is None
    again.close()
    path.write_text("[]\n")
    with pytest.raises(InputError, match="line 1, is not a link"):
        People(path)


def test_data_belong_to_one_server_whatever_its_links(tmp_path: Path) -> None:
    first = People(tmp_path / "one.jsonl", data=tmp_path / "data")
    (tmp_path / "same").symlink_to(tmp_path / "data")
    for place in ("data", "same"):
        with pytest.raises(InputError, match="another server uses the data folder"):
            People(tmp_path / "two.jsonl", data=tmp_path / place)
    People(tmp_path / "two.jsonl", data=tmp_path / "other").close()
    first.close()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["same"]
    People(tmp_path / "two.jsonl", data=tmp_path / "data").close()


@pytest.mark.parametrize("password", [" ", "\t\n"])
def test_a_blank_password_starts_no_server(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, password: str) -> None:
    (tmp_path / "design.toml").write_text(NECKER)
    monkeypatch.setenv("FOCALGRADIENT_PASSWORD", password)
    monkeypatch.setattr("focalgradient.web.run", lambda *_, **__: pytest.fail("a server was started"))
    monkeypatch.chdir(tmp_path)
    said = sentence(run("serve", "design.toml", "--data", "data", "--port", 0))
    assert "FOCALGRADIENT_PASSWORD is blank" in said


def test_a_page_of_older_sources_is_not_served(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    web = tmp_path / "web"
    for name in ("page", "static"):
        shutil.copytree(str(files("focalgradient.web") / name), web / name)
    (web / "gl.js").write_bytes((files("focalgradient.live") / "gl.js").read_bytes())
    monkeypatch.setattr(sys.modules["focalgradient.web.application"], "files", lambda _: web)
    check_page()
    with (web / "page" / "knob.js").open("a") as source:
        source.write("// changed\n")
    with pytest.raises(InputError, match=r"older sources: run 'make'"):
        check_page()
    (web / "static" / "sources.sha256").unlink()  # as a bundle of before has none
    with pytest.raises(InputError, match="is not built"):
        check_page()


def test_a_folder_that_cannot_be_written_is_refused_before_anybody_takes_part(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "design.toml").write_text(NECKER)
    (tmp_path / "there").mkdir()
    # Root may write anywhere, so the disk is said to be read-only.
    monkeypatch.setattr(os, "access", lambda path, how: how != os.W_OK or Path(path) != tmp_path / "there")
    words = ("serve", tmp_path / "design.toml", "--links", tmp_path / "links.jsonl", "--port", 0, "--data")
    for data in (tmp_path / "there", tmp_path / "there" / "data"):
        assert "there cannot be written: change its permissions" in sentence(run(*words, data))
        assert not (tmp_path / "links.jsonl").exists()
