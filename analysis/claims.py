"""The paper's claims with the measured results: the table at the start of the report.

Every number is taken from the run's ``numbers.json``, and every verdict follows from it by a rule in this file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

__all__ = ["CLAIMS", "Answer", "Claim", "answers"]

HOLDS, IN_PART, FAILS = "holds", "holds in part", "does not hold"
OPEN = "open: people have not been asked"

Numbers = Mapping[str, Mapping[str, Any]]
"""Summaries by figure, as in ``numbers.json``."""


@dataclass(frozen=True, slots=True)
class Claim:
    """Claim of the paper, with the rule that evaluates it.

    Parameters
    ----------
    section
        Section of the paper.
    claim
        Short statement of the claim.
    figures
        Names of the figures with the numbers, the most relevant first.
    answer
        Function from the summaries by figure to measured value and verdict.
    """

    section: str
    claim: str
    figures: tuple[str, ...]
    answer: Callable[[Numbers], tuple[str, str]]


@dataclass(frozen=True, slots=True)
class Answer:
    """Row of the table."""

    section: str
    claim: str
    measured: str
    verdict: str
    figure: str
    command: str


def answers(numbers: Mapping[str, Mapping[str, Any]]) -> list[Answer]:
    """Evaluate every claim.

    Parameters
    ----------
    numbers
        Content of ``numbers.json``: ``summary`` and ``plotted`` by figure. Claims whose figure is missing are reported
        as not measured in this run.
    """
    found = {name: one["summary"] for name, one in numbers.items()}
    rows = []
    for claim in CLAIMS:
        missing = [name for name in claim.figures if name not in found]
        measured, verdict = (
            (f"{', '.join(missing)} was left out of this run", "not measured") if missing else claim.answer(found)
        )
        figure = claim.figures[0] if claim.figures else ""
        command = f"python analysis/{figure}.py" if figure else "focalgradient run pinhole"
        rows.append(Answer(claim.section, claim.claim, measured, verdict, figure, command))
    return rows


def _edges(found: Numbers) -> tuple[str, str]:
    one = found["estimators"]
    name = "edges, one image"
    multiple, bias = one["worst_multiple_of_bound"][name], one["largest_bias_percent"][name]
    return (
        f"error at most {multiple:.2g} times the least possible, bias at most {bias:.2g} % of the blur",
        HOLDS if multiple < 3 and bias < 5 else IN_PART,
    )


def _spectra(found: Numbers) -> tuple[str, str]:
    one = found["estimators"]
    multiple, bias = one["worst_multiple_of_bound"]["spectra"], one["largest_bias_percent"]["spectra"]
    best = one["worst_multiple_of_bound"]["equalise (default)"]
    return (
        f"error at most {multiple:.2g} times the least possible, bias at most {bias:.2g} % of the blur (our default "
        f"method: {best:.2g} times)",
        HOLDS if multiple < 3 and bias < 5 else IN_PART,
    )


def _gaussian(found: Numbers) -> tuple[str, str]:
    one = found["eye_gaussian"]
    at_1, at_2 = (one[f"left_of_white_spread_at_{d}_D_by_pupil_percent"] for d in (1, 2))
    low, high = one["k_white_0.75_to_2_D_3_to_6_mm_least_and_largest"]
    return (
        f"in white light the best Gaussian leaves {min(at_1):.0f} to {max(at_1):.0f} % of the point spread at 1 D of "
        f"defocus, {min(at_2):.0f} to {max(at_2):.0f} % at 2 D; its sigma is {low:.2f} to {high:.2f} of the disc’s "
        "radius, not 1",
        HOLDS if max(at_2) < 10 else IN_PART,
    )


def _two_percent(found: Numbers) -> tuple[str, str]:
    e = found["fig2_measured"]["relative_error_of_blur_e_percent"]
    return f"{e:.2g} % from two rendered views with 1 % noise", HOLDS if e <= 2.5 else FAILS


def _stereo(found: Numbers) -> tuple[str, str]:
    one = found["fig2"]
    near, far = one["distances_where_both_are_equal_m"]
    times = one["focal_gradient_error_at_4_m_m"] / one["stereo_error_at_4_m_m"]
    return (
        f"with the paper’s own numbers blur is the better only from {near:.2f} to {far:.2f} m; at 4 m its error is "
        f"{times:.2g} times that of stereopsis",
        HOLDS if times < 2 else "holds near the focus only",
    )


def _autofocus(found: Numbers) -> tuple[str, str]:
    one = found["autofocus"]
    needs = [
        value
        for key, value in one.items()
        if "images_autofocus_needs" in key and value is not None and value != float("inf")
    ]
    return (
        f"autofocus needs {min(needs):.0f} to {max(needs):.0f} images to be as exact as two views by blur, not 30; "
        "with 30 it is the more exact",
        HOLDS if min(needs) >= 30 else IN_PART if min(needs) > 2 else FAILS,
    )


def _half_second(found: Numbers) -> tuple[str, str]:
    one = found["estimators"]
    disparity = one["focal_disparity_of_256_x_256_pixels_ms"]
    depth = one["time_for_256_x_256_pixels_ms"]["ratio (real time)"]
    return (
        f"{disparity:.2g} ms for the focal disparity, {depth:.0f} ms for calibrated depth with its uncertainty",
        HOLDS if disparity < 500 else FAILS,
    )


def _segments(found: Numbers) -> tuple[str, str]:
    one = found["fig4"]
    share = one["segments_in_the_right_class_percent"]
    return (
        f"{one['segments']:.0f} of {one['segments_detected']} segments are estimated from one view, {share:.0f} % of "
        f"these in the right class, {one['pairs_in_the_right_order_percent']:.0f} % of their pairs in the right order "
        f"(through a pinhole {one['pinhole_pairs_in_the_right_order_percent']:.0f} %); from two views "
        f"{one['two_views_segments']:.0f}, {one['two_views_segments_in_the_right_class_percent']:.0f} and "
        f"{one['two_views_pairs_in_the_right_order_percent']:.0f} %",
        HOLDS if share > 95 else IN_PART,
    )


def _disparity(found: Numbers) -> tuple[str, str]:
    one = found["fig5"]
    return (
        f"{one['valid_percent']:.0f} % of the pixels are estimated, with a median error of "
        f"{one['median_error_of_the_rest_D']:.2g} D away from reflections",
        HOLDS if one["valid_percent"] > 75 and one["median_error_of_the_rest_D"] < 0.05 else IN_PART,
    )


def _reflections(found: Numbers) -> tuple[str, str]:
    one = found["fig5"]
    behind = one["reflections_read_behind_their_surface_percent"]
    return (
        f"{behind:.0f} % are estimated behind their surface: it lies at "
        f"{one['surface_where_a_reflection_is_read_D']:.3g} D, traced rays put the reflection at "
        f"{one['reflection_traced_D']:.3g} D, blur at {one['reflection_read_D']:.3g} D",
        HOLDS if behind > 90 else IN_PART,
    )


def _check(found: Numbers) -> tuple[str, str]:
    one = found["check"]
    kinds = ("too_little_texture", "moving_object", "occlusion_edge", "reflection", "saturation")
    shares = {kind.replace("_", " "): one[f"{kind}_found_at_default_percent"] for kind in kinds}
    listed = ", ".join(f"{kind} {share:.0f} %" for kind, share in shares.items())
    return (
        f"wrong answers that disagreement finds: {listed}. So agreement does not prove it",
        HOLDS if min(shares.values()) > 95 else IN_PART,
    )


def _bands(found: Numbers) -> tuple[str, str]:
    one = found["eye_depth"]
    apart = one["difference_of_focus_between_the_bands_D"]
    side, error = one["side_right_mean"]["bands"], one["rms_error_at_10_m_4_mm_m"]["bands"]
    return (
        f"the bands’ foci are {apart:.2f} D apart; by them a simulated eye finds the side of focus in "
        f"{100 * side:.1f} % of the pixels, and errs by {error:.2g} m at 10 m (the paper’s 2 %: "
        f"{found['fig2']['focal_gradient_error_at_10_m_m']:.1g} m)",
        HOLDS if side > 0.95 and 0.5 < apart < 1.5 else IN_PART,
    )


def _oscillation(found: Numbers) -> tuple[str, str]:
    one = found["eye_depth"]
    side, error = one["side_right_mean"]["oscillation"], one["rms_error_at_10_m_4_mm_m"]["oscillation"]
    return (
        f"two views 250 ms and 0.5 D apart give the side of focus in {100 * side:.1f} % of the pixels, and err by "
        f"{error:.2g} m at 10 m",
        HOLDS if side > 0.95 else IN_PART,
    )


def _simulated(one: Mapping[str, Any]) -> str:
    return f"{OPEN}; simulated observers, whose assumptions make it so" if one["simulated"] else ""


def _fig3(found: Numbers) -> tuple[str, str]:
    one = found["fig3"]
    near, far = (one.get(f"rise_with_{end}_in_focus_and_its_interval") for end in ("nearest", "farthest"))
    if near is None or far is None:
        return "the rises could not be estimated", "not measured"
    text = ", ".join(
        f"{word} in focus {value:.2f} [{low:.2f}, {high:.2f}]"
        for word, (value, low, high) in (("nearest", near), ("farthest", far))
    )
    verdict = _simulated(one) or (HOLDS if near[1] > 1 and far[1] <= 1 <= far[2] else IN_PART if near[1] > 1 else FAILS)
    return f"depth at f/5.6 over the pinhole’s: {text}", verdict


def _necker(found: Numbers) -> tuple[str, str]:
    one = found["necker"]
    none, most = one["nonrigid_share_without_a_gradient_percent"], one["nonrigid_share_at_its_largest_percent"]
    if none is None or most is None:
        return "the shares could not be estimated", "not measured"
    verdict = _simulated(one) or (HOLDS if 40 <= most <= 60 else FAILS)
    return f"nonrigid share of the time {none:.0f} % without a gradient, {most:.0f} % with one that favours it", verdict


def _pinhole(_: Numbers) -> tuple[str, str]:
    return "the demonstration, with its viewing tube as control, can be run with people", OPEN


def _grossman(found: Numbers) -> tuple[str, str]:
    one = found["grossman"]
    reach = one["card_within_1.25_cm_up_to_m"]
    if reach is None:
        return "no card within 1.25 cm", FAILS
    return (
        f"a card’s edges are within 1.25 cm up to {reach:.3g} m with a 50 mm lens at f/8, and off by "
        f"{one['largest_error_of_a_card_at_3_m_cm']:.2g} cm at 3 m; Grossman’s lens and distances are not known",
        "holds up to that distance",
    )


CLAIMS = (
    Claim("II.A, Eqs. 2–6", "Blur can be measured along sharp edges of one image.", ("estimators",), _edges),
    Claim("II.B, Eqs. 7–10", "Blur can be measured from two apertures, whatever the scene.", ("estimators",), _spectra),
    Claim("Appendix", "Blur in white light is nearly Gaussian.", ("eye_gaussian",), _gaussian),
    Claim("II.C", "The size of blur can be estimated to about 2 %.", ("fig2_measured",), _two_percent),
    Claim("II.C, Fig. 2", "Accuracy is comparable to stereopsis to several metres.", ("fig2",), _stereo),
    Claim("I", "One or two images do what takes autofocus 30 or more.", ("autofocus",), _autofocus),
    Claim("III.C", "A depth map of 256 × 256 pixels in under half a second.", ("estimators",), _half_second),
    Claim("III.A, Fig. 4", "Blur of edges sorts a noisy indoor image by depth.", ("fig4",), _segments),
    Claim("III.B, Fig. 5", "The focal disparity map is fairly accurate.", ("fig5",), _disparity),
    Claim("III.B, Fig. 5", "Reflections are estimated behind the mirror, rightly.", ("fig5",), _reflections),
    Claim("II.B.2, Eq. 11", "Three views check the answer: if they agree it is right.", ("check",), _check),
    Claim("II.D", "Two bands, 1 D apart, give the eye two views at once.", ("eye_depth", "fig2"), _bands),
    Claim("II.D", "Focus that oscillates at 2 Hz gives two views in 250 ms.", ("eye_depth",), _oscillation),
    Claim("II.D, Fig. 3", "Blur adds depth with the nearest object in focus, not with the farthest.", ("fig3",), _fig3),
    Claim("II.D", "A gradient makes the nonrigid Necker cube seen almost as often as the rigid.", ("necker",), _necker),
    Claim("II.D", "A pinhole before the eye takes the sense of depth away.", (), _pinhole),
    Claim("IV", "Grossman: ± 1.25 cm by edges with a standard lens.", ("grossman",), _grossman),
)
"""Claims in the paper's terms; "almost as often" is taken as a nonrigid proportion of 40 to 60 %."""
