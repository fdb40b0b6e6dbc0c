"""Published experiments, by their key in the bibliography, as `experiments.toml` states them.

Numbers that no available source prints are omitted; only the direction of the effect is then compared.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from functools import partial
from math import inf
from pathlib import Path
from typing import Any

from focalgradient.published import distance, following, ratings, thresholds
from focalgradient.published.record import Finding, Prediction, Published
from focalgradient.stimuli import PAPERS

__all__ = ["ASK", "EXPERIMENTS", "kruger1993"]

ASK: Mapping[str, Callable[..., Prediction]] = {
    "rise": ratings.rise,
    "nonrigid_change": ratings.nonrigid_change,
    "judged_over": distance.judged_over,
    "gain": partial(following.against_white, measure=following.gain_of_mean),
    "phase": partial(following.against_white, measure=following.phase_of_mean),
    **{name: getattr(thresholds, name) for name in thresholds.__all__},
}
"""Functions that ask an observer, by the name that the table gives them; settings are those of the table."""

TABLE = tomllib.loads(Path(__file__).with_name("experiments.toml").read_text(encoding="utf-8"))


def _published(key: str, **further: Any) -> Published:
    """Return the record of an experiment; `further` are settings of its questions that the table does not state."""

    def finding(stated: Mapping[str, Any]) -> Finding:
        asked = dict(stated.get("ask", {}))
        ask = partial(ASK[asked.pop("of")], **asked, **further) if asked else None
        remark = stated["remark"].format(**further) if further else stated["remark"]
        return Finding(**{"low": -inf, "high": inf, **stated, "ask": ask, "remark": remark})

    stated = TABLE[key]
    conditions = tuple(stated.get("conditions") or PAPERS[key].conditions)
    findings = tuple(map(finding, stated.get("findings", ())))
    return Published(**{"key": key, "doi": "", **stated, "conditions": conditions, "findings": findings})


def kruger1993(pairs: int = following.PAIRS, kept: Path | None = None) -> Published:
    """Return the record of the experiment on accommodation, with predictions from `pairs` pairs of trials.

    Parameters
    ----------
    pairs
        Number of pairs, 2 or more; about 10 s of processor time each, for all lights together.
    kept
        Cache folder with one file per pair, so that interrupted runs continue; empty it if the model changes.
    """
    return _published("kruger1993", pairs=pairs, kept=kept)


EXPERIMENTS: dict[str, Published] = {key: kruger1993() if key == "kruger1993" else _published(key) for key in TABLE}
"""Published experiments, by key in the bibliography."""
