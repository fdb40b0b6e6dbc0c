"""The words of the screen: the same entries in each language, and what is wrong with a laboratory's own file."""

import pytest
from command_line import run

from focalgradient.design import NeckerDesign
from focalgradient.design.words import LANGUAGES, load_words, words_text
from focalgradient.errors import InputError
from focalgradient.experiments.necker import CubePages
from focalgradient.web.lists import Lists


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_language_can_be_copied_changed_and_read(language, tmp_path):
    text = words_text(language).replace('name = "', 'name = "My ', 1)
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    mine, theirs = load_words("mine.toml", tmp_path), load_words(language)
    assert mine.entries.keys() == theirs.entries.keys() == load_words("en").entries.keys()
    assert mine.sha256 != theirs.sha256
    assert mine("depth.question") == theirs("depth.question")


def test_german_says_nothing_in_english():
    english, german = load_words("en"), load_words("de")
    alike = {name for name, text in english.entries.items() if german.entries[name] == text}
    assert alike == {"common.no_key"}


WRONG = {
    "missing": ("stop_keys =", "xyz_unused =", r"common\.xyz_unused is not an entry of the texts"),
    "misspelt": ("moment =", "momemt =", r"common\.momemt is not an entry of the texts: did you mean common\.moment"),
    "empty": ('moment = "One moment ..."', 'moment = " "', r"common\.moment must be a text, and not empty"),
    "strange brace": ("{done} of {total}", "{doen} of {total}", r"session\.rest has \{doen\}, which is unknown"),
    "one key": ('yes_key = "y"', 'yes_key = "n"', r"common\.yes_key and common\.no_key must be two different letters"),
}


@pytest.mark.parametrize("way", WRONG)
def test_what_is_wrong_with_words_is_said_in_one_sentence(way, tmp_path):
    old, new, sentence = WRONG[way]
    text = words_text("en")
    assert old in text
    (tmp_path / "mine.toml").write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=sentence) as caught:
        load_words("mine.toml", tmp_path)
    assert str(caught.value).count("\n") == 0


def test_all_missing_texts_are_named_also_by_the_command_that_lists_trials(tmp_path):
    english = words_text("en").splitlines()
    lacks = ("moment", "escape", "gamma_slider")
    text = "\n".join(line for line in english if line.partition(" =")[0] not in lacks)
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    design = tmp_path / "design.toml"
    design.write_text('task = "necker"\nlanguage = "mine.toml"\n')
    missing = [name for name in load_words("en").entries if name.partition(".")[2] in lacks]
    assert len(missing) == 3
    with pytest.raises(InputError, match=f"the entries {', '.join(missing)} are missing: copy them"):
        load_words("mine.toml", tmp_path)
    shown = run("trials", design, "--participant", "01")
    assert shown.exit_code == 2
    assert all(name in shown.stderr for name in missing)


@pytest.mark.parametrize(("language", "space"), [("en", "SPACE"), ("de", "LEERTASTE")])
def test_keys_are_named_in_the_participants_language(language, space, tmp_path):
    design = NeckerDesign(gradients=("none",), keys=("left", "space"), language=language)
    text = "\n".join(page.text for page in CubePages(design, load_words(language), "01").opening())
    assert f"  {space}  " in text
    assert "  ←  " in text
    (entry,) = Lists(design).shown("01", design.trials("01")[:1])
    assert (entry["scale"]["keys"], entry["scale"]["names"]) == (["left", "space"], ["←", space])
    older = words_text(language).replace("[keys]", "[removed]")
    start, end = older.index("[removed]"), older.index("[form]")
    (tmp_path / "older.toml").write_text(older[:start] + older[end:])
    assert load_words("older.toml", tmp_path).key("space") == "SPACE"
