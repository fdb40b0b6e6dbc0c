"""Place of testing (laboratory or browser), and visual angle of the stimuli with its uncertainty."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from focalgradient.dataset import DataSet
from focalgradient.errors import is_number
from focalgradient.files import read_json
from focalgradient.report.document import Table
from focalgradient.report.tables import Sheet
from focalgradient.statistics import NeckerResult, factor_effects
from focalgradient.statistics.questions import NO_ANSWERS, Answers
from focalgradient.statistics.wording import number

__all__ = [
    "ViewedScreen",
    "blur_seen",
    "place_effects",
    "place_effects_of_cube",
    "screens",
    "screens_sheet",
    "with_place",
]

LABORATORY, BROWSER = "laboratory", "browser"

PLACE = "place"
"""Name of the factor."""


@dataclass(frozen=True, slots=True)
class ViewedScreen:
    """Viewing conditions of a participant in the first run of a session.

    Parameters
    ----------
    participant_id, session
        Participant and session; "" without session labels.
    place
        `LABORATORY` or `BROWSER`.
    distance_m, distance_sd_m
        Viewing distance in metres with its standard error; NaN if unknown. The error is 0 if the laboratory states the
        distance.
    arcmin, arcmin_sd
        Visual angle of a display pixel with its standard error, in arcmin; NaN if unknown.
    gamma, gamma_sd
        Display gamma with its standard error: measured by the laboratory (error 0), or from the participant's matches;
        NaN if neither was done.
    manifest
        SHA-256 of the picture manifest.
    """

    participant_id: str
    session: str
    place: str
    distance_m: float
    distance_sd_m: float
    arcmin: float
    arcmin_sd: float
    gamma: float
    gamma_sd: float
    manifest: str | None


def screens(data: DataSet) -> list[ViewedScreen]:
    """Return the viewing conditions of each session with a person; simulated observers have none."""
    found = []
    for files, sidecar in data.sidecars.items():
        sitting = next(iter(sidecar.get("Sittings") or ()), None)
        if sidecar.get("Simulated") or not isinstance(sitting, dict):
            continue
        place = BROWSER if "browser" in sitting.get("Versions", {}) else LABORATORY
        apparatus = sitting.get("Apparatus") or {}
        gamma = apparatus.get("gamma_seen") or (apparatus.get("gamma") or math.nan, 0.0)
        seen = (*_angles(apparatus), *gamma, sidecar.get("StimuliSHA256"))
        found.append(ViewedScreen(f"sub-{files.participant}", files.session or "", place, *seen))
    return found


def _angles(apparatus: Mapping[str, Any]) -> tuple[float, float, float, float]:
    """Return viewing distance (m), its standard error, pixel angle (arcmin), and its standard error."""
    distance, sd = apparatus.get("viewing_distance_m") or math.nan, apparatus.get("viewing_distance_sd_m") or 0.0
    size, pixels = apparatus.get("screen_m"), apparatus.get("screen_px")
    if math.isnan(distance) or not (size and pixels):
        return distance, sd, math.nan, 0.0
    pitch = size[0] / pixels[0]
    size_sd = (apparatus.get("screen_sd_m") or (0.0, 0.0))[0] / size[0]
    # the blind-spot distance is in pixels: the error of the card affects distance and pitch equally, and cancels
    relative = math.sqrt(max((sd / distance) ** 2 - size_sd**2, 0.0))
    arcmin = 60 * math.degrees(math.atan(pitch / distance))
    return distance, sd, arcmin, arcmin * relative


def screens_sheet(seen: Sequence[ViewedScreen], name: str) -> list[Sheet]:
    """Return a table of the screens, one row each; none if no screen is known."""
    if all(math.isnan(one.arcmin) for one in seen):
        return []
    matched = any(one.gamma_sd for one in seen)
    headings = ("distance (cm)", "pixels a degree", "pixel (arcmin)", "gamma")[: 3 + matched]
    names = ("distance", "cm"), ("pixels_per_degree", ""), ("pixel_arcmin", ""), ("gamma", "")
    columns = [f"{of}{end}{'_' * bool(unit)}{unit}" for of, unit in names[: 3 + matched] for end in ("", "_sd")]
    rows, digits = [], []
    for one in seen:
        distance, degree_sd = (100 * one.distance_m, 100 * one.distance_sd_m), 60 * one.arcmin_sd / one.arcmin**2
        angles = (60 / one.arcmin, degree_sd if one.arcmin_sd else 0.0), (one.arcmin, one.arcmin_sd)
        values = [distance, *angles, (one.gamma, one.gamma_sd)][: 3 + matched]
        who = [one.participant_id, one.session, one.place]
        rows.append([*who, *(_with_error(value, sd) for value, sd in values)])
        digits.append([*who, *(part for pair in values for part in pair)])
    caption = "Screens, first sitting: ± standard error where size and distance were estimated by card and blind spot"
    if matched:
        caption += ", gamma by matching greys (sRGB, for which pictures are made by default, is like 2.2)"
    file = f"{name}_screens.csv"
    table = Table(caption, ["subject", "session", "place", *headings], rows, csv=file, folded=len(rows) > 12)
    return [Sheet(file, table, pd.DataFrame(digits, columns=["participant_id", "session", "place", *columns]))]


def _with_error(value: float, sd: float) -> str:
    return number(value) if not sd or math.isnan(value) else f"{number(value)} ± {number(sd, 2)}"


def blur_seen(
    data: DataSet, seen: Sequence[ViewedScreen], participants: Collection[str]
) -> dict[str, tuple[float, float]]:
    """Return the blur of each aperture as participants saw it, in arcmin, and its standard deviation over participants.

    The blur is the largest of each picture, averaged over scenes; the deviation includes differences between
    participants and the uncertainty of each participant's screen and distance. Empty if the screens, or the blur of the
    pictures, are unknown.

    Parameters
    ----------
    data
        Data set with the manifests of the pictures.
    seen
        Viewing conditions, from `screens`.
    participants
        Participants analysed.
    """
    known = [one for one in seen if one.participant_id in participants]
    shown = {one.manifest for one in known}
    if not known or len(shown) != 1 or None in shown or any(math.isnan(one.arcmin) for one in known):
        return {}
    files = next(iter(data.sidecars))
    place = files.manifest(str(next(iter(shown))))
    if not place.exists():
        return {}
    content = read_json(place, "a manifest of stimuli")
    blur: dict[str, list[float]] = {}
    pictures = content.get("pictures") if isinstance(content, dict) else None
    for picture in pictures if isinstance(pictures, list) else ():
        pixels = picture.get("blur_px") if isinstance(picture, dict) else None
        if not pixels:
            continue
        if not (isinstance(pixels, list) and all(map(is_number, pixels))):  # null: imported without depth
            return {}
        blur.setdefault(str(picture.get("aperture")), []).append(max(pixels))
    arcmin = np.array([one.arcmin for one in known], float)
    error = math.sqrt(float(arcmin.var()) + float(np.mean([one.arcmin_sd**2 for one in known])))
    return {
        name: (float(np.mean(pixels)) * float(arcmin.mean()), float(np.mean(pixels)) * error)
        for name, pixels in blur.items()
    }


def with_place(seen: Sequence[ViewedScreen], table: pd.DataFrame) -> pd.DataFrame:
    """Return the table with a column of places if participants were tested in several."""
    places = {one.participant_id: one.place for one in seen}
    several = len({*places.values()}) > 1
    return table.assign(**{PLACE: table["participant_id"].map(places)}) if several else table


def place_effects(
    seen: Sequence[ViewedScreen],
    table: pd.DataFrame,
    *,
    ratios: bool = False,
    unit: str = "",
    answer: str = "rating",
) -> Answers:
    """Compare participants tested in a browser with those in the laboratory; empty if all were tested in one place."""
    table = with_place(seen, table)
    if PLACE not in table or {*table[PLACE].dropna()} != {LABORATORY, BROWSER}:
        return NO_ANSWERS
    table = table[table[PLACE].notna()]
    factors = {PLACE: {"levels": [LABORATORY, BROWSER], "vary": "between"}}
    return factor_effects(table, factors, ratios=ratios, unit=unit, answer=answer)


def place_effects_of_cube(seen: Sequence[ViewedScreen], result: NeckerResult) -> Answers:
    """Compare the places by log odds of the nonrigid time; the gradient for the nonrigid reading counts as blur."""
    signs = {"nonrigid": 1.0, "none": 0.0, "rigid": -1.0}
    rows = [
        {
            "participant_id": share.participant_id,
            "aperture_mm": signs[share.gradient] * share.strength,
            "catch": False,
            "rating": share.log_odds,
        }
        for share in result.subject_shares
        if share.log_odds is not None
    ]
    return place_effects(seen, pd.DataFrame(rows), unit="log odds", answer="log_odds") if rows else NO_ANSWERS
