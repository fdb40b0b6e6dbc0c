"""Tables of one's own: wide or long, any names, and whatever is assumed is noted; never anything but an InputError."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from focalgradient import InputError
from focalgradient.statistics import depth_rating, read_ratings

LONG = "subject,fstop,focus,resp\nA,pinhole,near,1.0\nA,f5.6,near,1.4\nB ,0,far,0.9\nB,5.6,farthest,1.2\n"


def write(folder: Path, text: str, encoding: str = "utf-8") -> Path:
    path = folder / "own.csv"
    path.write_bytes(text.encode(encoding))
    return path


def test_long_with_names_of_its_own(tmp_path: Path) -> None:
    names = {"participant": "subject", "aperture": "fstop", "fixation": "focus", "rating": "resp"}
    own = read_ratings(write(tmp_path, LONG), names, focal_length_mm=28)
    assert own.table["participant_id"].tolist() == ["A", "A", "B", "B"]
    assert own.table["aperture"].tolist() == ["pinhole", "f/5.6", "pinhole", "f/5.6"]
    assert own.table["aperture_mm"].tolist() == pytest.approx([0, 5, 0, 5])
    assert own.table["fixation"].tolist() == ["nearest", "nearest", "farthest", "farthest"]
    assert own.table["trial"].tolist() == [1, 2, 1, 2]
    assert not own.table["catch"].any()
    said = " ".join(own.notes)
    for part in ("Spaces at the ends", "no column of catch trials", "Trials are numbered", "no column of scenes"):
        assert part in said


def test_names_that_are_plain_need_no_columns(tmp_path: Path) -> None:
    assert len(read_ratings(write(tmp_path, LONG)).table) == 4


def test_decimal_commas_and_conditions_in_another_language(tmp_path: Path) -> None:
    text = "Versuchsperson;Blende;Fokus;Urteil\nÄ;scharf;vorn;1,0\nÄ;offen;vorn;1,45\nÄ;f/11,0;hinten;0,9\n"
    own = read_ratings(
        write(tmp_path, text, "cp1252"),
        {"participant": "Versuchsperson", "aperture": "Blende", "fixation": "Fokus", "rating": "Urteil"},
        {"scharf": "pinhole", "offen": "f/5.6", "vorn": "nearest", "hinten": "farthest"},
    )
    assert own.table["rating"].tolist() == [1.0, 1.45, 0.9]
    assert own.table["aperture"].tolist() == ["pinhole", "f/5.6", "f/11"]


def test_wide(tmp_path: Path) -> None:
    text = "id\tscene\tnear_pinhole\tnear_f5.6\tfar f/5.6\n1\troom\t1\t1.5\t1.1\n2\troom\t1\tNaN\t\n"
    own = read_ratings(write(tmp_path, text))
    cells = own.table[["participant_id", "scene", "fixation", "aperture", "rating"]].to_numpy().tolist()
    assert cells == [
        ["1", "room", "nearest", "pinhole", 1.0],
        ["1", "room", "nearest", "f/5.6", 1.5],
        ["1", "room", "farthest", "f/5.6", 1.1],
        ["2", "room", "nearest", "pinhole", 1.0],
    ]
    assert any("2 rows without a rating were left out (participants 2)" in note for note in own.notes)


def test_wide_with_scenes_in_the_names(tmp_path: Path) -> None:
    text = "subject,room_near_pinhole,room_near_f5.6,tree_near_pinhole\n1,1,1.5,1.1\n"
    assert read_ratings(write(tmp_path, text)).table["scene"].tolist() == ["room", "room", "tree"]


def test_what_is_read_can_be_analysed(tmp_path: Path) -> None:
    rows = [
        f"{who},s{scene},{aperture},near,{1 + 0.1 * who * number + 0.02 * scene * number}"
        for who in range(1, 6)
        for scene in range(6)
        for number, aperture in enumerate(("0", "f5.6"))
    ]
    own = read_ratings(write(tmp_path, "\n".join(["subject,scene,aperture,focus,rating", *rows])))
    assert "Satterthwaite" in depth_rating(own.table, equivalence_bound=1.2).fixations[0].rise.method


BAD = {
    "nothing": ("", "no header"),
    "no participant": ("a,aperture,focus,rating\n1,0,near,1\n", "no column for participant: name it with --columns"),
    "no rating": ("subject,focus\n1,near\n", "no column of ratings"),
    "twice": ("subject,subject\n1,1\n", "the column subject twice"),
    "text": ("subject,aperture,focus,rating\n1,0,near,deep\n", "row 2: rating is 'deep', but must be a number"),
    "negative": ("subject,aperture,focus,rating\n1,0,near,-1\n", "row 2 .*rating is -1.0"),
    "aperture": ("subject,aperture,focus,rating\n1,wide,near,1\n", "row 2: aperture is 'wide'"),
    "fixation": ("subject,aperture,focus,rating\n1,0,middle,1\n", "row 2: fixation is 'middle'"),
    "no name": ("subject,aperture,focus,rating\n,0,near,1\n", "row 2: the participant is missing"),
    "all empty": ("subject,aperture,focus,rating\n1,0,near,\n", "holds no rating"),
    "catch": ("subject,aperture,focus,rating,catch\n1,0,near,1,perhaps\n", "catch is 'perhaps'"),
    "too long": ("subject,aperture,focus,rating\n1,0,near,1,2,3\n", "row 2: there are 6 cells, but must be 4"),
    "binary": ("a\0b,c\n", "is not a table of text"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_wrong_is_named(tmp_path: Path, name: str) -> None:
    text, sentence = BAD[name]
    with pytest.raises(InputError, match=sentence):
        read_ratings(write(tmp_path, text))


def test_columns_that_are_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="has no column vp for participant: it has subject"):
        read_ratings(write(tmp_path, LONG), {"participant": "vp"})
    with pytest.raises(InputError, match="columns: colour is not known"):
        read_ratings(write(tmp_path, LONG), {"colour": "resp"})


CELLS = st.sampled_from(
    ["", " ", "A", "near", "far", "f5.6", "5,6", "0", "nan", "inf", "1e999", "-1", "1,5", '"', "x\ny", "é", "="]
)


@given(st.lists(st.lists(CELLS, max_size=6), max_size=6), st.sampled_from([",", ";", "\t"]))
@settings(max_examples=150, deadline=None)
def test_any_text_is_read_or_refused_in_one_sentence(tmp_path_factory, rows, delimiter) -> None:
    head = delimiter.join(["subject", "aperture", "focus", "rating", "catch"])
    text = "\n".join([head, *(delimiter.join(row) for row in rows)])
    try:
        read_ratings(write(tmp_path_factory.mktemp("own"), text))
    except InputError as error:
        assert "\n" not in str(error)  # noqa: PT017  either outcome will do
