"""The figure of published experiments, of those that are asked at once: what it draws, counts and keeps as a table."""

import published
import pytest
from report import images

from focalgradient.published import EXPERIMENTS, predicted_beside_published


@pytest.fixture
def shown(monkeypatch):
    few = [EXPERIMENTS["jacobs1989"], EXPERIMENTS["konrad2016"]]
    monkeypatch.setattr(
        published, "predicted_beside_published", lambda observer, *_: predicted_beside_published(observer, few)
    )
    return published.make()


def test_scores_are_counted_and_drawn_as_simulated(shown):
    assert shown.summary == {
        "agrees": 1,
        "differs": 2,
        "undecided": 0,
        "cannot be asked": 1,
        "agree and are independent": 1,
    }
    words = [text.get_text() for text in shown.figure.axes[0].texts]
    assert words.count("differs") == 2
    assert "Simulated" in words
    assert [text.get_text() for text in shown.figure.texts] == ["a simulated observer"]


def test_the_table_is_kept_beside_the_picture(shown):
    lines = images(shown)["csv"].decode().splitlines()
    assert len(lines) == 5
    assert "predicted (simulated)" in lines[0]
