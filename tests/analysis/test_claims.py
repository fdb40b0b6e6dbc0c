"""The table of the paper's claims: every answer from numbers, every verdict by a rule that can fail."""

from __future__ import annotations

import json
from pathlib import Path

import claims
import fig2
import pytest
import report
import reproduce

SCRIPTS = Path(__file__).parents[2] / "analysis"

NUMBERS = {
    "estimators": {
        "worst_multiple_of_bound": {"edges, one image": 1.8, "spectra": 1.3, "equalise (default)": 1.05},
        "largest_bias_percent": {"edges, one image": 1.0, "spectra": 1.5, "equalise (default)": 0.5},
        "focal_disparity_of_256_x_256_pixels_ms": 3.0,
        "time_for_256_x_256_pixels_ms": {"ratio (real time)": 260.0},
    },
    "eye_gaussian": {
        "left_of_white_spread_at_1_D_by_pupil_percent": [12.0, 18.0],
        "left_of_white_spread_at_2_D_by_pupil_percent": [27.0, 31.0],
        "k_white_0.75_to_2_D_3_to_6_mm_least_and_largest": [0.5, 0.6],
    },
    "fig2_measured": {"relative_error_of_blur_e_percent": 0.8},
    "fig2": {
        "distances_where_both_are_equal_m": [1.818, 2.222],
        "focal_gradient_error_at_4_m_m": 0.08,
        "focal_gradient_error_at_10_m_m": 0.8,
        "stereo_error_at_4_m_m": 0.016,
    },
    "autofocus": {"plane_images_autofocus_needs_to_match_two_foci": 4.4, "other_images_autofocus_needs": None},
    "fig4": {
        "segments": 42.0,
        "segments_detected": 942,
        "segments_in_the_right_class_percent": 86.0,
        "pairs_in_the_right_order_percent": 89.0,
        "pinhole_pairs_in_the_right_order_percent": 32.0,
        "two_views_segments": 611.0,
        "two_views_segments_in_the_right_class_percent": 97.0,
        "two_views_pairs_in_the_right_order_percent": 97.0,
    },
    "fig5": {
        "valid_percent": 36.0,
        "median_error_of_the_rest_D": 0.027,
        "reflections_read_behind_their_surface_percent": 97.0,
        "surface_where_a_reflection_is_read_D": 1.04,
        "reflection_traced_D": 0.94,
        "reflection_read_D": 0.98,
    },
    "check": {
        f"{kind}_found_at_default_percent": share
        for kind, share in (
            *(("too_little_texture", 0.0), ("moving_object", 95.5), ("occlusion_edge", 85.0)),
            *(("reflection", 86.0), ("saturation", 56.0)),
        )
    },
    "eye_depth": {
        "difference_of_focus_between_the_bands_D": 0.78,
        "side_right_mean": {"bands": 0.999, "oscillation": 1.0},
        "rms_error_at_10_m_4_mm_m": {"bands": 2.4, "oscillation": 1.1},
    },
    "fig3": {
        "simulated": True,
        "rise_with_nearest_in_focus_and_its_interval": [1.36, 1.19, 1.55],
        "rise_with_farthest_in_focus_and_its_interval": [0.89, 0.8, 1.01],
    },
    "necker": {
        "simulated": True,
        "nonrigid_share_without_a_gradient_percent": 18.0,
        "nonrigid_share_at_its_largest_percent": 53.0,
    },
    "grossman": {"card_within_1.25_cm_up_to_m": 2.5, "largest_error_of_a_card_at_3_m_cm": 1.9},
}


def answered(changes: dict[str, dict[str, object]] | None = None) -> dict[str, claims.Answer]:
    numbers = {name: {"summary": one | (changes or {}).get(name, {}), "plotted": {}} for name, one in NUMBERS.items()}
    return {one.claim: one for one in claims.answers(numbers)}


def verdict(word: str, changes: dict[str, dict[str, object]] | None = None) -> str:
    (found,) = (one.verdict for claim, one in answered(changes).items() if word in claim)
    return found


def test_every_claim_is_answered_with_a_figure_and_a_command() -> None:
    rows = answered()
    assert len(rows) == len(claims.CLAIMS) == 17
    names = {name for name, _, _ in reproduce.FIGURES}
    for one in rows.values():
        assert one.verdict != "not measured"
        if one.figure:
            assert one.figure in names
            assert (SCRIPTS / f"{one.figure}.py").exists()
            assert one.command == f"python analysis/{one.figure}.py"


@pytest.mark.parametrize(
    ("word", "changes", "said"),
    [
        ("stereopsis", None, "holds near the focus only"),
        ("2 %", None, "holds"),
        ("half a second", None, "holds"),
        ("check", None, "holds in part"),
        ("fairly accurate", None, "holds in part"),
        ("nearest", None, f"{claims.OPEN}; simulated observers, whose assumptions make it so"),
        (
            "nearest",
            {"fig3": {"simulated": False, "rise_with_nearest_in_focus_and_its_interval": [1.0, 0.9, 1.1]}},
            "does not hold",
        ),
        ("Grossman", {"grossman": {"card_within_1.25_cm_up_to_m": None}}, "does not hold"),
    ],
)
def test_verdicts_follow_from_the_numbers(word: str, changes: dict[str, dict[str, object]] | None, said: str) -> None:
    assert verdict(word, changes) == said


def test_the_numbers_of_a_figure_are_those_of_the_table() -> None:
    numbers = json.loads(report.numbers_json({"fig2": fig2.make()}))
    (row,) = (one for one in claims.answers(numbers) if "stereopsis" in one.claim)
    assert "only from 1.82 to 2.22 m; at 4 m its error is 5 times" in row.measured
