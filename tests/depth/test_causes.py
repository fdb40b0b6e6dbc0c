"""Where nothing is valid, the likeliest cause is named first: over frames each with one cause that is known."""

from dataclasses import asdict, replace
from types import SimpleNamespace

import blurred
import numpy as np
import pytest
from blurred import TILE, lens, wall
from judged import said
from rejected_frames import frames

from focalgradient.depth import causes
from focalgradient.depth.causes import Evidence, rank_causes

SOUND = Evidence(
    displacement=0.02,
    agreement=0.99,
    agreement_as_given=0.99,
    signal=900.0,
    fine_signal=80.0,
    contrast=0.06,
    noise=0.004,
    textured=0.7,
    blocks=1.02,
    usable=1.0,
    blur=0.5,
)


def named(frame):
    """The first cause; None where depth is valid."""
    depth, text = said(frame.views, **frame.limits)
    found = depth.details.get("rejected_causes")
    if found is None:
        return None
    assert f"valid, most likely because {found[0]['text']}" in text.splitlines()[0]
    return found[0]["name"]


@pytest.mark.slow
def test_the_first_cause_is_right_on_a_grid_of_frames(monkeypatch):
    monkeypatch.setattr(blurred, "SHAPE", (144, 192))
    found = [(frame.cause, named(frame)) for frame in frames([0])]
    rejected = [(cause, name) for cause, name in found if name is not None]
    assert len(rejected) > 25
    assert np.mean([cause == name for cause, name in rejected]) > 0.9


def test_nothing_is_wrong_with_sound_evidence():
    assert max(cause.evidence for cause in rank_causes(SOUND)) < 0.5


def test_blocks_of_compression_beside_hard_edges_are_not_the_first_cause():
    found = replace(SOUND, textured=0.01, blocks=50.0)
    assert [cause.name for cause in rank_causes(found)[:2]] == ["edges", "jpeg"]
    assert rank_causes(replace(found, textured=0.7))[0].name == "jpeg"


@pytest.mark.parametrize(("explained", "first"), [(0.22, "contradiction"), (0.7, "edges")])
def test_edges_are_not_advised_where_views_agree_at_no_depth(explained, first, monkeypatch):
    """Two photographed rooms: bars on glass before a window, and an overexposed desk."""
    monkeypatch.setattr(causes, "measure_evidence", lambda problem, estimate: replace(SOUND, textured=0.13))
    problem = SimpleNamespace(
        settings=SimpleNamespace(method="equalise"), search=SimpleNamespace(lowest=0, highest=0.6)
    )
    estimate = SimpleNamespace(details={"share_of_texture_explained": explained}, searched=None)
    found = causes.likely_causes(problem, estimate)
    assert found[0].name == first
    if first == "contradiction":
        assert "at 78% of the places with texture, whatever the distance from 1.67 m to infinity" in found[0].text
        assert "change near and far" in found[0].text


def regular(kind: str) -> np.ndarray:
    down, right = np.mgrid[:TILE, :TILE]
    return 0.2 + 0.6 * ((down // 6 + right // 6) % 2 if kind == "checks" else right // 4 % 2).astype(float)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "apertures"), [("checks", (8, 2.8)), ("stripes", (16, 5.6))])
def test_texture_that_repeats_itself_is_not_displaced(kind, apertures):
    views = wall([lens(f_number) for f_number in apertures], 1.3, field=regular(kind), noise=0.003)
    depth, text = said(views, near=0.85, far=6)
    assert "displaced" not in text
    assert "one scene" not in text
    assert depth.valid.any()


@pytest.mark.parametrize("kind", ["blank", "two scenes"])
def test_noise_and_different_scenes_are_not_displaced(kind, monkeypatch):
    """Registration finds a place by chance, and its sentence would send people to `--align`."""
    monkeypatch.setattr(blurred, "SHAPE", (144, 192))
    seeds = (0, 1)
    pair = [wall([lens(16), lens(5.6)], 1.3, noise=0.004, seed=seed) for seed in seeds]
    views = [pair[0][0], pair[1][1]]
    if kind == "blank":
        noise = [0.4 + 0.004 * np.random.default_rng(seed).standard_normal((TILE, TILE)) for seed in seeds]
        views = [replace(view, image=image) for view, image in zip(views, noise, strict=True)]
    depth, text = said(views, near=0.85, far=6)
    assert depth.details["rejected_causes"][0]["name"] == {"blank": "texture", "two scenes": "scenes"}[kind]
    assert "against view 1" not in text


def test_evidence_does_not_depend_on_the_unit_of_light(monkeypatch):
    monkeypatch.setattr(blurred, "SHAPE", (96, 128))
    seen = []

    def noted(evidence, *given):
        seen.append(evidence)
        return rank_causes(evidence, *given)

    monkeypatch.setattr(causes, "rank_causes", noted)
    noise = [0.4 + 0.004 * np.random.default_rng(seed).standard_normal((96, 128)) for seed in (0, 1)]
    for unit in (1.0, 255.0):
        views = wall([lens(16), lens(5.6)], 1.3)
        said([replace(view, image=unit * image) for view, image in zip(views, noise, strict=True)], near=0.85, far=6)
    assert asdict(seen[1]) == pytest.approx(asdict(seen[0]), rel=1e-3)


def test_reversed_contrast_and_views_blurred_by_40_pixels_show_one_scene():
    assert rank_causes(replace(SOUND, agreement=-0.98, agreement_as_given=-0.98))[0].name == "reversal"
    assert "one scene" not in said(wall([lens(2.8, 0.5), lens(1.4, 0.5)], 1.5, noise=0.003), near=0.5)[1]


@pytest.mark.slow
def test_a_telecentric_lens_stated_as_another_is_no_displacement(monkeypatch):
    """Two foci whose pictures are of one magnification, as of a telecentric lens, differ in scale, not in place."""
    monkeypatch.setattr(blurred, "SHAPE", (144, 192))
    lenses = [lens(16, 0.3), lens(16, 2.0)]
    angles = [8e-6 / optics.sensor_distance for optics in lenses]
    views = wall(lenses, 0.52, noise=0.003)
    depth, text = said([replace(view, pixel_angle=angle) for view, angle in zip(views, angles, strict=True)])
    assert depth.details["rejected_causes"][0]["name"] == "optics"
    assert "most likely because view 2 is magnified against view 1 as by a lens that is telecentric" in text
