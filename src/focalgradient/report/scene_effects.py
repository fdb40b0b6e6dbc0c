"""Effects by scene, with the pictures that were shown: what a meta-analysis of data sets with common scenes needs."""

from __future__ import annotations

import json

import pandas as pd

from focalgradient.dataset import DataSet
from focalgradient.dataset.plausible import pictures_of
from focalgradient.dataset.stimuli import read_manifest
from focalgradient.errors import InputError
from focalgradient.report.analysed import Ratings
from focalgradient.statistics import Effect, NotComputed
from focalgradient.statistics.questions import HERE

__all__ = ["SCENE_EFFECTS", "scene_effects", "scene_effects_file"]

SCENE_EFFECTS = "_scene_effects.json"
"""End of the name of a section's file of effects by scene: an object whose ``effects`` are rows of `scene_effects`."""

COLUMNS = ["what", "scene", "pictures_sha256", "effect", "standard_error"]


def scene_effects(part: Ratings) -> pd.DataFrame:
    """Return each main effect for these scenes together, and for each scene, averaged over subjects.

    Returns
    -------
    DataFrame
        Columns what, scene (empty: these scenes together), pictures_sha256 (of each picture of the scene, with spaces
        between; empty without a manifest), effect, and standard_error over subjects (of these scenes together). Answers
        in steps have no effects by scene (NaN), as the model of steps has one effect for all scenes.
    """
    result = part.main
    if isinstance(result, NotComputed):
        return pd.DataFrame(columns=COLUMNS)
    rows: list[tuple[object, ...]] = []
    for each in result.answers.headlines:
        test = result.answers.to(each.name + HERE).get(each.level)
        if isinstance(test, Effect):
            rows.append((each.headline, "", "", test.estimate, test.standard_error))
    digests = {} if part.data is None else _digests(part.data)
    scenes = sorted(set(part.kept[~part.kept["catch"]]["scene"].astype(str)))
    for each in result.answers.headlines:
        means = pd.Series(dtype=float) if each.values is None else each.values.mean()
        for scene, effect in means.reindex(scenes).items():
            rows.append((each.headline, scene, digests.get(str(scene), ""), effect, None))
    return pd.DataFrame(rows, columns=COLUMNS)


def scene_effects_file(part: Ratings) -> bytes:
    """Return the content of the file of effects by scene."""
    return json.dumps({"effects": json.loads(scene_effects(part).to_json(orient="records"))}).encode()


def _digests(data: DataSet) -> dict[str, str]:
    """Return the SHA-256 of all pictures of each scene, over all sets of pictures that were shown."""
    shown: dict[str, set[str]] = {}
    manifests = {
        files.manifest(str(sidecar["StimuliSHA256"]))
        for files, sidecar in data.sidecars.items()
        if sidecar.get("StimuliSHA256")
    }
    for path in manifests:
        try:
            hashes = read_manifest(path).files
        except InputError:  # the check of the data set names it
            continue
        for (scene, *_), file in pictures_of(path).items():
            shown.setdefault(scene, set()).add(hashes.get(file, ""))
    return {scene: " ".join(sorted(own - {""})) for scene, own in shown.items()}
