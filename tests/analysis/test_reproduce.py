"""The whole run: what it leaves, what it leaves alone, and that its report needs nothing else."""

import json
import re
from html.parser import HTMLParser

import fig2
import fig6
import numpy as np
import pytest
import report
import reproduce

from focalgradient.plotting import new_figure

QUICK = (("fig6", fig6.make, 1.0), ("fig2", fig2.make, 1.0))


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    out = tmp_path_factory.mktemp("run") / "results"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reproduce, "FIGURES", QUICK)
        reproduce.reproduce(out, quiet=True)
    return out


def test_numbers_are_strict_json_and_hold_what_is_drawn(results):
    def refuse(constant):
        raise AssertionError(f"{constant} is not JSON")

    numbers = json.loads((results / "numbers.json").read_text(encoding="utf-8"), parse_constant=refuse)
    assert set(numbers) == {"fig6", "fig2"}
    curve = numbers["fig2"]["plotted"]
    assert curve["focal_gradient_error_m"][curve["distance_m"].index(4.0)] == pytest.approx(0.08)


def test_report_is_one_page_that_needs_nothing_else(results):
    text = (results / "report.html").read_text(encoding="utf-8")
    sources, links, open_tags = [], [], []

    class Reader(HTMLParser):
        def handle_starttag(self, tag, attributes):
            sources.extend(value for name, value in attributes if name in ("src", "srcset", "data"))
            links.extend(value for name, value in attributes if name == "href")
            if tag not in ("meta", "img", "link"):
                open_tags.append(tag)

        def handle_endtag(self, tag):
            assert open_tags.pop() == tag

    Reader().feed(text)
    assert not open_tags
    assert len(sources) == 2
    assert all(source.startswith("data:image/png;base64,") for source in sources)
    assert links == ["#fig2", "#fig6", "#fig2"]  # of the table of claims, of the contents
    assert text.index("The paper’s claims") < text.index("<h2>Figures")
    assert not re.search(r"https?://|url\(|@import|<script|<link", text)
    assert "<td>0.08</td>" in text


def test_a_stopped_run_leaves_the_results_and_goes_on_where_it_was(results, tmp_path, monkeypatch, capsys):
    made = []

    def counted(**options):
        made.append("fig6")
        return fig6.make(**options)

    def interrupted(**options):
        raise KeyboardInterrupt

    (tmp_path / "report.html").write_text("earlier")
    (tmp_path / "unfinished").mkdir()  # of another program: not used
    (tmp_path / "unfinished" / "made-by").write_text("another")
    (tmp_path / "unfinished" / "fig6.json").write_text("{}")
    monkeypatch.setattr(reproduce, "FIGURES", (("fig6", counted, 1.0), ("fig2", interrupted, 1.0)))
    monkeypatch.setattr("sys.argv", ["reproduce.py", "--out", str(tmp_path)])
    assert reproduce.main() == 130
    assert made == ["fig6"]
    assert {file.name for file in tmp_path.iterdir()} == {"report.html", "unfinished"}
    assert (tmp_path / "report.html").read_text() == "earlier"
    assert "goes on from" in capsys.readouterr().err

    monkeypatch.setattr(reproduce, "FIGURES", (("fig6", counted, 1.0), QUICK[1]))
    assert reproduce.main() == 0
    assert made == ["fig6"]
    for file in results.iterdir():  # the same as of a run that was not stopped
        assert (tmp_path / file.name).read_bytes() == file.read_bytes(), file.name


@pytest.mark.slow
@pytest.mark.figure_with_faults
def test_a_figure_with_cut_content_ends_in_failure(tmp_path, monkeypatch, capsys):
    def cut(**options):
        shown = fig6.make(**options)
        shown.figure.axes[0].text(0.5, 0.5, "a label beyond all bounds" * 20)
        return shown

    monkeypatch.setattr(reproduce, "FIGURES", (("fig6", cut, 1.0), QUICK[1]))
    monkeypatch.setattr("sys.argv", ["reproduce.py", "--out", str(tmp_path)])
    assert reproduce.main() == 1
    assert (tmp_path / "report.html").exists()
    assert re.search("fig6: 'a label beyond .* leaves the figure", capsys.readouterr().err)


def test_a_folder_that_cannot_be_written_is_said_in_one_sentence(tmp_path, monkeypatch, capsys):
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(reproduce, "FIGURES", QUICK)
    monkeypatch.setattr("sys.argv", ["reproduce.py", "--out", str(tmp_path / "file")])
    assert reproduce.main() == 2
    assert "cannot be written" in capsys.readouterr().err


def test_what_is_not_finite_is_null_and_text_is_escaped():
    shown = report.Shown(
        "a < b", ("c & d",), new_figure(), {"share_percent": np.nan, "n": np.int64(3)}, {"x": np.array([1.0, np.inf])}
    )
    numbers = json.loads(report.numbers_json({"one": shown}))
    assert numbers["one"] == {
        "title": "a < b",
        "caption": ["c & d"],
        "summary": {"share_percent": None, "n": 3},
        "plotted": {"x": [1.0, None]},
    }
    text = report.report_html({"one": shown}, {"one": b""}, "remark")
    assert "a &lt; b" in text
    assert "c &amp; d" in text
    assert "share (%)" in text
