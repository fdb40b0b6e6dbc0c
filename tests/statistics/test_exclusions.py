"""Exclusion criteria are blind to the effect under study: honest people stay in, whatever blur does to them."""

import math

import numpy as np
import pandas as pd
import pytest
from statsmodels.stats.inter_rater import cohens_kappa  # type: ignore[import-untyped]

from focalgradient.scales import analysis_named
from focalgradient.statistics import Rules, blur_thresholds, depth_rating, quality
from focalgradient.statistics.judging import _most_frequent, _passed, _start_agreement

APERTURES = (("pinhole", 0.0), ("f/22", 2.27), ("f/11", 4.55), ("f/5.6", 8.93))
STEPS = 7
MIDDLE = {"ratio": 1.0, "ordinal": 4.0, "bipolar": 0.0, "choice": 0.5}


def answer(scale: str, depth: float, rng: np.random.Generator) -> float:
    """What is answered to a depth, the logarithm of a ratio to the standard."""
    if scale == "ratio":
        return round(float(np.clip(math.exp(depth), 0.25, 4)), 1)
    if scale == "choice":
        return float(rng.random() < 1 / (1 + math.exp(-6 * depth)))
    middle, half = MIDDLE[scale], STEPS // 2
    return float(np.clip(round(middle + half * depth + 0.3 * rng.normal()), middle - half, middle + half))


def table(
    seed: int,
    scale: str,
    effects: list[float],
    *,
    constant: int = 0,
    level: float = 0.3,
    gains: float = 0.8,
    noise: float = 0.1,
    catch: int = 6,
) -> pd.DataFrame:
    """Honest subjects with an effect each, on scenes that differ, and others who give one answer to everything."""
    rng = np.random.default_rng(seed)
    scenes, gain = rng.normal(0, level, 8), 1 + gains * rng.normal(size=8)
    rows = []
    for who, effect in enumerate([*effects, *[None] * constant]):
        pictures = [
            (f"s{scene}", aperture, mm, fixation, False, depth + math.log(effect or 1) * gain[scene] * mm / 8.93)
            for scene, depth in enumerate(scenes)
            for fixation in ("nearest", "farthest")
            for aperture, mm in APERTURES
            for _ in range(2)
        ]
        for number in range(catch):
            kind, depth = (("example-flat", -1.0), ("example-deep", 1.0), ("standard", 0.0))[number % 3]
            if kind != "standard" or scale in ("ratio", "bipolar"):
                pictures.append((kind, "pinhole", 0.0, "nearest", True, depth))
        for trial, (scene, aperture, mm, fixation, caught, depth) in enumerate(pictures):
            interval = 1 + trial % 2
            given = answer(scale, depth + noise * rng.normal(), rng)
            if effect is None:
                given = float(interval == 1) if scale == "choice" else MIDDLE[scale]
            rows.append((f"{who:02}", trial, scene, aperture, mm, fixation, given, caught, 1.2, interval))
    names = ["participant_id", "trial", "scene", "aperture", "aperture_mm", "fixation", "rating", "catch"]
    made = pd.DataFrame(rows, columns=[*names, "response_time", "interval"])
    return made if scale == "choice" else made.drop(columns="interval")


def left_out(rows: pd.DataFrame, scale: str = "ratio") -> set[str]:
    _, found = quality(rows, None, scale, MIDDLE[scale])
    return {one.participant_id for one in found.exclusions if one.whole_subject}


@pytest.mark.parametrize("scale", MIDDLE)
@pytest.mark.parametrize("catch", [0, 6])
def test_nobody_honest_is_left_out_whatever_blur_does_to_him(scale: str, catch: int) -> None:
    """Blind people among sighted ones, and the reverse; with scenes that gain very unequally by blur."""
    for seed, few in enumerate((1.0, 1.3, 3.0)):
        most = 1.6 if few == 1 else 1.0
        assert left_out(table(seed, scale, [few] * 4 + [most] * 8, catch=catch), scale) == set()


@pytest.mark.parametrize("level", [0.0, 0.05])
def test_the_blind_are_kept_where_scenes_do_not_differ(level: float) -> None:
    """Five of twelve answer 1.0 to everything, as they should; leaving them out made 1.19 a 1.35."""
    rows = table(1, "ratio", [1.0] * 5 + [1.35] * 7, level=level, gains=0.0, noise=0.02, catch=0)
    kept, found = quality(rows)
    assert found.exclusions == ()
    assert "must differ whatever blur does" in {one.rule: one.reason for one in found.unjudged}["same_answer"]
    ratio = math.exp(depth_rating(kept, equivalence_bound=1.2).fixations[0].rise.estimate)
    assert ratio == pytest.approx(1.35 ** (7 / 12), abs=0.02)


@pytest.mark.parametrize("scale", ["ratio", "ordinal", "bipolar"])
def test_one_answer_to_everything_is_left_out_by_catch_trials(scale: str) -> None:
    rows = table(2, scale, [1.0] * 3 + [1.5] * 3, constant=2, level=0.0)
    if scale == "ordinal":  # four catch trials: too few for the share of one answer, enough for what is right
        assert left_out(rows, scale) == {"06", "07"}
        return
    _, found = quality(rows, Rules(catch_passed=None), scale, MIDDLE[scale])
    assert {one.participant_id for one in found.exclusions} == {"06", "07"}
    assert {one.rule for one in found.exclusions} == {
        "gave one and the same answer to more than 90% of pictures that must differ"
    }


@pytest.mark.parametrize("scale", ["ratio", "ordinal", "bipolar"])
def test_one_answer_to_everything_is_left_out_by_scenes_that_most_tell_apart(scale: str) -> None:
    for seed in range(3):
        rows = table(seed, scale, [1.0] * 6 + [1.5] * 6, constant=1, level=0.8, catch=0)
        assert left_out(rows, scale) == {"12"}


@pytest.mark.parametrize(("varied", "people", "judged"), [(4, 8, False), (5, 8, True), (2, 3, False), (3, 4, True)])
def test_the_majority_and_three_people_must_tell_scenes_apart(varied: int, people: int, judged: bool) -> None:
    """Where only half do, or two people, the scenes may be alike to honest eyes."""
    rows = table(1, "ratio", [1.0] * varied, constant=people - varied, level=0.8, catch=0)
    assert left_out(rows) == ({f"{who:02}" for who in range(varied, people)} if judged else set())


def test_one_key_of_a_choice_is_no_reason_where_blur_alone_decides() -> None:
    """Who sees no difference and prefers the first picture is honest; catch trials find who does not look."""
    rows = table(3, "choice", [3.0] * 6, constant=1, catch=0)
    assert left_out(rows, "choice") == set()
    assert left_out(table(3, "choice", [3.0] * 6, constant=1, catch=18), "choice") == {"06"}


def test_catch_trials_that_are_nearly_all_alike_do_not_judge_sameness() -> None:
    rows = table(4, "ratio", [1.3] * 6, level=0.0, noise=0.01)
    standard = rows[rows["scene"] == "standard"]
    more = pd.concat([standard] * 12).assign(trial=lambda own: range(1000, 1000 + len(own)))
    assert left_out(pd.concat([rows, more], ignore_index=True)) == set()


def test_a_blurred_picture_is_no_catch_trial_with_a_right_answer() -> None:
    """What its rating should be depends on what blur does."""
    rows = table(5, "ratio", [3.0] * 6, catch=0)
    rows["catch"] = rows["aperture_mm"].eq(8.93) & rows["scene"].eq("s0")
    _, found = quality(rows)
    assert all(one.catch_passed is None for one in found.subjects)
    assert "right or wrong whatever blur does" in {one.rule: one.reason for one in found.unjudged}["catch_passed"]


def test_answers_at_the_low_end_of_steps_are_no_lapses() -> None:
    """One step more or less near 1 is a large ratio: who sees little depth was left out."""
    rng = np.random.default_rng(6)
    rows = table(6, "ordinal", [1.0] * 6, level=0.0, catch=0)
    rows["rating"] = np.where(rows["participant_id"] == "00", rng.choice([1.0, 3.0], len(rows)), rows["rating"])
    assert left_out(rows, "ordinal") == set()


@pytest.mark.parametrize("steps", [2, 3, 7])
def test_honest_answers_agree_with_random_places_by_chance(steps: int) -> None:
    for seed in range(8):
        rng = np.random.default_rng(seed)
        rows = table(seed, "ordinal", [1.0] * 4, level=0.0, catch=0)
        rows["start"] = rng.integers(1, steps + 1, len(rows)).astype(float)
        rows["rating"] = rng.integers(1, steps + 1, len(rows)).astype(float)
        rows.loc[rows["participant_id"] == "01", "rating"] = rows["start"]
        assert left_out(rows, "ordinal") == {"01"}


def test_agreement_with_the_start_is_cohens_kappa_and_needs_twenty_answers_in_two_steps() -> None:
    rng = np.random.default_rng(9)
    answers, start = rng.integers(1, 5, (2, 60)).astype(float)
    start[:30] = answers[:30]
    counts = np.histogram2d(answers, start, bins=np.arange(0.5, 5))[0]
    found = _start_agreement({"rating": answers, "start": start})
    assert found == pytest.approx(cohens_kappa(counts).kappa)
    for number, judged in ((18, False), (20, True)):  # places where two steps are equally frequent
        two = np.tile([1.0, 2.0], number // 2)
        assert (_start_agreement({"rating": two, "start": two}) is not None) == judged
    same = np.ones(40)
    assert _start_agreement({"rating": same, "start": same}) is None  # one step: every answer agrees by chance


def test_sameness_is_judged_from_five_answers_on_and_the_standard_is_passed_within_one_step() -> None:
    for count, share in ((4, None), (5, 0.6)):
        rating, whole = np.array([1.0, 1.0, 1.0, 2.0, 3.0])[:count], np.ones(count, bool)
        assert _most_frequent({"rating": rating, "side": np.full(count, np.nan), "pinhole": whole}, True) == share
        side = np.array([-1.0, 1.0, -1.0, 1.0, -1.0])[:count]
        assert _most_frequent({"rating": rating, "side": side, "pinhole": ~whole}, True) == share
    answers = np.array([0.0, 1.0, -1.0, 2.0, -2.0])
    passed = _passed(answers, np.zeros(5), Rules(), analysis_named("bipolar"))
    assert passed.tolist() == [True, True, True, False, False]


def test_keys_are_judged_without_a_gradient_only() -> None:
    """How long neither reading is reported may be an effect of the gradient."""
    row = {"strength": 0.0, "censored": False, "trial_duration": 10.0, "catch": False}
    rows = []
    for who, plain, blurred in (("undecided", 9.0, 3.0), ("silent", 3.0, 9.0)):
        for trial, (gradient, seen) in enumerate((("none", plain), ("nonrigid", blurred))):
            of = {**row, "participant_id": who, "trial": trial, "gradient": gradient, "strength": 4.0 * trial}
            rows += [{**of, "onset": 0.0, "duration": seen, "percept": "rigid"}]
            rows += [{**of, "onset": seen, "duration": 10 - seen, "percept": "none"}]
    _, found = quality(pd.DataFrame(rows))
    assert {one.participant_id for one in found.exclusions} == {"silent"}
    assert found.trials_before == 4


def test_high_thresholds_are_in_the_mean() -> None:
    """Catch trials show the greatest level, which whoever has a high threshold misses."""
    rng = np.random.default_rng(7)
    rows = []
    for who, threshold in (("a", 0.1), ("b", 0.12), ("c", 1.9)):
        levels = np.r_[np.geomspace(0.02, 2.0, 30).repeat(2), np.full(10, 2.0)]
        right = rng.random(len(levels)) < 1 - 0.5 ** (1 + (levels / threshold) ** 3.5)
        catch = np.arange(len(levels)) >= 60
        right[catch] &= who != "c"
        named = {"participant_id": who, "session": "", "trial": range(len(levels))}
        rows.append(pd.DataFrame({**named, "level": levels, "correct": right, "catch": catch}))
    found = blur_thresholds(pd.concat(rows), least=0.02, most=2.0)
    assert [one.kept for one in found.subjects] == [True, True, False]
    assert found.mean.estimate > 2 * found.mean_attending.estimate
