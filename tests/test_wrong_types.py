"""Values of wrong types, huge numbers and huge files: one sentence, at once."""

import dataclasses
import io
import json
import math
import sys
import time
import zipfile
from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest
from command_line import run, sentence

from focalgradient import InputError, Lens, eye, scenes
from focalgradient.dataset import Rated
from focalgradient.design import DepthRatingDesign
from focalgradient.display import Display
from focalgradient.optics import DualPixel
from focalgradient.power import Model, Study
from focalgradient.retina import FixationalMovements
from focalgradient.statistics import Rules, read_ratings
from focalgradient.stimuli import read_set

sys.path.append(str(Path(__file__).parent / "experiments"))
from headless import make_set

DEEP: list[object] = []
for _ in range(2000):
    DEEP = [DEEP]
WRONG = {
    "text": "0.9",
    "huge": 10**400,
    "NaN": math.nan,
    "list": [1],
    "table": {},
    "array": np.zeros((2, 2)),
    "array without shape": np.array("x"),
    "bytes": b"x",
    "complex": 1j,
    "deep": DEEP,
    "object": object(),
    "huge point": (10**400, 0.0, 1.0),
    "point of texts": ("a", 0.0, 1.0),
}
SQUARE = np.array([[0, 0, 1.0], [0.1, 0, 1], [0.1, 0.1, 1]])
RECORDS = [
    Lens(0.025, 8, 0.5),
    Display(),
    Model(),
    Study(Model(), DepthRatingDesign()),
    Rules(),
    Rated(onset=1.0, rating=1.0, response_time=1.0),
    DualPixel(Lens(0.05, 4, 1.0)),
    scenes.Texture(),
    scenes.Plane((0, 0, 2.0), (0, 0, -1.0)),
    scenes.Sphere((0, 0, 1.0), 0.05),
    scenes.Mesh(SQUARE, np.array([[0, 1, 2]]), SQUARE[:, :2], np.full((2, 2, 3), 0.5)),
    scenes.Sky(np.ones((2, 4, 3))),
    scenes.Mark("near", (0.0, 0.0, 0.5)),
    scenes.Scene(()),
    scenes.NeckerCube(),
    *(eye.Target(), eye.Plant(), eye.Pulse(), eye.Scatter(), eye.Motion(), eye.Microfluctuations(), eye.Oscillation()),
    *(eye.Accommodation(), eye.Stimulus(), eye.EyePrior(), eye.Correction(), eye.Refraction(-1.0), eye.Photons(9.0)),
    *(
        eye.Eye(0.004, 1.0),
        eye.ZonedLens((0.004,), (1.0,)),
        eye.Cones.of(eye.Eye(0.004, 1.0), "S"),
        eye.EyeDescription(),
        eye.ViewingConditions(),
        FixationalMovements(),
    ),
]
FACTORIES: dict[Callable[..., object], dict[str, object]] = {
    scenes.plane: {"distance": 1.0, "seed": 0},
    scenes.slant: {"near": 1.0, "far": 2.0, "field": 0.1, "seed": 0},
    scenes.step: {"near": 1.0, "far": 2.0, "seed": 0},
    scenes.spheres: {"seed": 0, "field": 0.1},
    scenes.terrain: {"seed": 0, "field": 0.1},
    scenes.naturalistic: {"seed": 0, "field": 0.1},
    scenes.bottle: {"seed": 0, "distance": 1.0},
    scenes.room: {"seed": 0},
    scenes.scene: {"name": "step", "seed": 0},
    scenes.departure_from_rigid: {"shape": np.ones((1, 8, 3))},
}


def test_a_field_of_a_wrong_type_is_refused() -> None:
    """In every field of every record: accepted, as a text for a name is, or refused in a sentence."""
    for record, (kind, value) in product(RECORDS, WRONG.items()):
        assert dataclasses.is_dataclass(record)
        messages = []
        for field in dataclasses.fields(record):
            try:
                dataclasses.replace(record, **{field.name: value})  # type: ignore[type-var]
            except InputError as error:
                messages.append(str(error))
            except Exception as error:
                pytest.fail(f"{type(record).__name__}, {field.name}, {kind}: {error!r}")
        case = f"{type(record).__name__}, {kind}: {messages}"
        assert messages, case
        assert all(message.endswith(".") and len(message) < 400 for message in messages), case


def test_a_factory_refuses_a_wrong_type() -> None:
    for (factory, given), (kind, value) in product(FACTORIES.items(), WRONG.items()):
        for name in given:
            message = f"nothing: {factory.__name__} takes {kind} for {name}"
            try:
                factory(**given | {name: value})
            except InputError as error:
                message = str(error)
            except Exception as error:
                pytest.fail(f"{factory.__name__}, {name}, {kind}: {error!r}")
            assert message.endswith(".")


HEAD = "participant,aperture,fixation,rating\n"
VALUES = (1, "0.9", True, None, [], {}, [None, None], [[1], {"a": 1}])


def leaves(node: Any) -> Iterator[tuple[Any, Any]]:
    """Every place in a tree: what it stands in, and its key there."""
    for key in list(node) if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ():
        yield node, key
        yield from leaves(node[key])


def test_a_manifest_with_wrong_types_is_refused(tmp_path: Path) -> None:
    """In every place of it, among them a fixation that is a number."""
    make_set(tmp_path, ["a"], (40, 30))
    path = tmp_path / "manifest.json"
    whole = json.loads(path.read_text())
    whole["pictures"] = whole["pictures"][:1]
    refused = 0
    for node, key in list(leaves(whole)):
        kept = node[key]
        for value in VALUES:
            node[key] = value
            path.write_text(json.dumps(whole))
            try:
                found = read_set(tmp_path)
                [found.scene(name) for name in found.scenes]
                found.check([("a", "pinhole", "nearest", {})], [])
            except InputError as error:
                refused += "manifest.json: " in str(error)
        node[key] = kept
    assert refused > 200
    whole["pictures"][0]["fixation"] = 1
    path.write_text(json.dumps(whole))
    with pytest.raises(InputError, match="pictures 1: fixation is 1, but must be the name of the fixated object"):
        read_set(tmp_path)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (lambda: ",".join(f"c{n}" for n in range(1_000_000)) + "\n" + "1," * 999_999 + "1\n", "1,000,000 columns"),
        (lambda: HEAD + "1," * 999_999 + "1\n", "1,000,000 columns"),
        (lambda: HEAD + "P1,pinhole,near,1\n" * 300_000, "rows, but a table may have 200,000 at most"),
        (lambda: HEAD + "P1,pinhole,near," + "1" * 2_000_000 + "\n", "field larger"),
    ],
    ids=["columns", "cells", "rows", "a cell"],
)
def test_a_table_beyond_reason_is_refused_at_once(text: Callable[[], str], what: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(text())
    start = time.process_time()
    assert what in sentence(run("report", tmp_path / "a.csv", "--out", tmp_path / "out"))
    assert time.process_time() - start < 30  # with what the command imports
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "cells",
    [
        pytest.param('<row r="1"><c r="A1" t="s"><v>²</v></c></row>', id="a superscript"),
        pytest.param('<row r="1"><c r="A1" t="s"><v>' + "9" * 5000 + "</v></c></row>", id="digits"),
        pytest.param(
            "".join(f'<row r="{row}"><c r="XFD{row}"><v>1</v></c></row>' for row in range(1, 50_000)),
            id="cells far to the right",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_a_damaged_workbook_is_refused(cells: str, tmp_path: Path) -> None:
    whole = io.BytesIO()
    openpyxl.Workbook().save(whole)
    with zipfile.ZipFile(whole) as sound, zipfile.ZipFile(tmp_path / "a.xlsx", "w", zipfile.ZIP_DEFLATED) as damaged:
        for part in sound.namelist():
            damaged.writestr(part, sound.read(part).replace(b"</sheetData>", f"{cells}</sheetData>".encode()))
    with pytest.raises(InputError, match=r"cannot be read as a workbook|too large for a table"):
        read_ratings(tmp_path / "a.xlsx")
