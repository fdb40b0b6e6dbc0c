"""Round trips with named programs: R, JASP and jamovi, PsychoPy, jsPsych and JATOS, and BIDS of other laboratories.

R runs where it is installed; of the other programs the files are written as they write them.
"""

from __future__ import annotations

import csv
import io
import json
import pickle
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from r_process import has_package, needs_r, run_r
from test_foreign_tables import HEAD, ROWS, TRIALS
from test_report_scripts import three_fixations

from focalgradient import InputError
from focalgradient.report import make_report
from focalgradient.report.export import trial_files
from focalgradient.statistics import depth_rating, read_ratings
from focalgradient.user_tables.conditions import read_conditions

RATINGS = [float(row[-1]) for row in ROWS]


def by_cell(table: pd.DataFrame) -> dict[tuple[str, ...], float]:
    names = ["participant_id", "scene", "aperture", "fixation"]
    return {tuple(row[:4]): row[4] for row in table[[*names, "rating"]].itertuples(index=False)}


R_WRITES = """
d <- read.csv("own.csv", stringsAsFactors = TRUE)
write.csv(d, "write.csv.csv")
write.csv(d, "row.names.csv", row.names = FALSE)
write.csv2(d, "write.csv2.csv")
write.table(d, "write.table.txt")
write.table(d, "tabs.tsv", sep = "\\t", quote = FALSE, na = "", row.names = FALSE)
sink("print.txt"); print(d, row.names = FALSE); sink()
d$key <- paste(d$fixation, d$aperture, d$scene, sep = "_")
w <- reshape(d[c("participant", "key", "rating")], idvar = "participant", timevar = "key", direction = "wide")
write.csv(w, "reshape.csv", row.names = FALSE)
"""


@needs_r
def test_r_writes_what_is_read(tmp_path: Path) -> None:
    pd.DataFrame(TRIALS).to_csv(tmp_path / "own.csv", index=False)
    (tmp_path / "write.R").write_text(R_WRITES)
    run_r(tmp_path, "write.R")
    written = [path for path in tmp_path.iterdir() if path.name not in ("own.csv", "write.R", "r-output.txt")]
    assert len(written) == 7
    expected = by_cell(read_ratings(tmp_path / "own.csv").table)
    for path in written:
        assert by_cell(read_ratings(path).table) == expected, path.name


R_READS = """
library(lme4)
d <- read.csv("depth_rating_trials.csv", na.strings = "n/a")
d <- d[d$fixation == "door", ]
cat(nrow(d), fixef(lmer(log(rating) ~ aperture_mm + (1 | participant_id) + (1 | scene), d)), "\\n")
"""


@needs_r
def test_lme4_reads_the_trials_of_a_report(tmp_path: Path) -> None:
    if not has_package("lme4"):
        pytest.skip("the R package lme4 is not installed")
    own = three_fixations()
    files = trial_files(own, own, depth_rating(own, equivalence_bound=1.2))
    (tmp_path / "depth_rating_trials.csv").write_bytes(files["depth_rating_trials.csv"])
    (tmp_path / "read.R").write_text(R_READS)
    count, *estimates = map(float, run_r(tmp_path, "read.R").split())
    door = own[own["fixation"] == "door"]
    assert count == len(door)
    slope, intercept = np.polyfit(door["aperture_mm"], np.log(door["rating"]), 1)  # equal, as the table is complete
    assert estimates == pytest.approx([intercept, slope], rel=1e-4)


def test_the_trials_of_a_report_come_back_from_jasp(tmp_path: Path) -> None:
    """JASP opens the CSV file, and Export Data writes it with a byte order mark and quotation marks."""
    pd.DataFrame(TRIALS).to_csv(tmp_path / "own.csv", index=False)
    own = read_ratings(tmp_path / "own.csv").table
    trials = pd.read_csv(io.BytesIO(trial_files(own, own, None)["depth_rating_trials.csv"]))
    trials.to_csv(tmp_path / "jasp.csv", index=False, quoting=csv.QUOTE_NONNUMERIC, encoding="utf-8-sig")
    assert by_cell(read_ratings(tmp_path / "jasp.csv").table) == by_cell(own)


def test_psychopys_files_of_a_folder_are_read(tmp_path: Path) -> None:
    """As `saveAsWideText` writes them: rows of instructions, columns of loops, a comma at the end of lines."""
    more = ["trials.thisRepN", "trials.thisN", "slider.rt", "participant", "session", "date", "psychopyVersion", ""]
    paths = []
    for who in range(1, 5):
        rows = [row for row in ROWS if row[0] == f"p{who}"]
        about = [f"p{who}", "001", "2026-05-04_10h01.02.345", "2025.1.1", ""]
        lines = [["", "", "", "", "", "", "", *about]]
        lines += [[*row[1:], "0", str(at), "1.25", *about] for at, row in enumerate(rows)]
        paths.append(tmp_path / f"p{who}_rating_2026-05-04_10h01.02.345.csv")
        with paths[-1].open("w", newline="", encoding="utf-8-sig") as file:
            csv.writer(file).writerows([["scene", "aperture", "focus", "slider.response", *more], *lines])
    columns = {"rating": "slider.response", "fixation": "focus", "response_time": "slider.rt"}
    own = read_ratings(paths, columns)
    assert own.table["rating"].tolist() == RATINGS
    assert set(own.table["response_time"]) == {1.25}
    pickled = tmp_path / "p1.psydat"
    pickled.write_bytes(pickle.dumps({"entries": TRIALS}))
    with pytest.raises(InputError, match=r"psydat.*give the CSV file that PsychoPy wrote beside it"):
        read_ratings(pickled)


@pytest.mark.parametrize("kind", ["json", "csv", "JATOS"])
def test_jspsychs_data_are_read(tmp_path: Path, kind: str) -> None:
    """As `jsPsych.data.get().json()` and `.csv()` write them, and JATOS, which puts one list a line."""
    data = [{"rt": 5201, "response": {"Q0": "22"}, "trial_type": "survey-text", "trial_index": 0, "participant": "p1"}]
    for at, trial in enumerate(TRIALS, start=1):
        shown = {name: trial[name] for name in HEAD[:-1]}
        data.append({"rt": 901.5, "response": None, "trial_type": "html-keyboard-response", "trial_index": 2 * at})
        data[-1]["participant"] = trial["participant"]
        answer = {"rt": 903.5, "response": float(trial["rating"]), "trial_type": "html-slider-response"}
        data.append(answer | {"trial_index": 2 * at + 1} | shown)
    text = io.StringIO()
    if kind == "csv":
        names = list(dict.fromkeys(name for row in data for name in row))
        rows = [[row.get(name, "") for name in names] for row in data]
        cells = [
            [json.dumps(cell) if isinstance(cell, dict) else "null" if cell is None else cell for cell in row]
            for row in rows
        ]
        csv.writer(text, quoting=csv.QUOTE_ALL).writerows([names, *cells])
    else:
        people = [[row for row in data if row["participant"] == f"p{who}"] for who in range(1, 5)]
        text.write(json.dumps(data) if kind == "json" else "\n".join(map(json.dumps, people)))
    path = tmp_path / ("data.csv" if kind == "csv" else "data.txt")
    path.write_text(text.getvalue())
    own = read_ratings(path, where={"trial_type": "html-slider-response"})
    assert own.table["rating"].tolist() == RATINGS


def test_events_of_bids_of_another_laboratory_are_read(tmp_path: Path) -> None:
    """Tables of a foreign task, with n/a in the rows of other events."""
    paths = []
    for who in range(1, 5):
        folder = tmp_path / f"sub-{who:02}" / "func"
        folder.mkdir(parents=True)
        lines = ["onset\tduration\ttrial_type\tblur_D\tjudged_depth\tresponse_time"]
        for at, (blur, depth) in enumerate([(0.0, 1.0), (0.5, 1.2), (1.0, 1.3 + who / 10)]):
            lines += [f"{4 * at}\t1\tfixation\tn/a\tn/a\tn/a", f"{4 * at + 1}\t2\tpicture\t{blur}\t{depth}\t0.8"]
        paths.append(folder / f"sub-{who:02}_task-blurry_events.tsv")
        paths[-1].write_text("\n".join(lines))
    (tmp_path / "dataset_description.json").write_text('{"Name": "x", "BIDSVersion": "1.8.0"}')
    with pytest.raises(InputError, match=r"sub-\*/\*/\*_events.tsv, .*--columns rating=NAME"):
        make_report(tmp_path)
    own = read_conditions(paths, {"rating": "judged_depth"}, by=["blur_D"])
    assert dict(own.conditions) == {"blur_D": [0.0, 0.5, 1.0]}
    assert own.table.groupby("participant_id").size().to_dict() == {f"sub-{who:02}": 3 for who in range(1, 5)}
    assert own.table["rating"].max() == pytest.approx(1.7)
