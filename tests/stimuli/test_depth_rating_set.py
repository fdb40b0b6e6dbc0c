"""A set of pictures: what its manifest says is so, conditions differ in blur only, nothing is lost or made twice."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from focalgradient import FocalGradientWarning, InputError, Lens
from focalgradient.dataset import check_stimuli
from focalgradient.display import Display
from focalgradient.optics import Aperture
from focalgradient.render import render
from focalgradient.render.mitsuba_backend import variant
from focalgradient.scenes import spheres
from focalgradient.stimuli import FIXATIONS, StimulusSet, depth_rating, make_depth_rating, read_set
from focalgradient.stimuli.depth_rating import FIELD, LEAST_DEPTH

SMALL = {"seed": 3, "scenes": 1, "size": 128, "engine": "cast", "samples": 16}
LENSES = {"f/22": 22.0, "f/11": 11.0, "f/5.6": 5.6}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> StimulusSet:
    return make_depth_rating(tmp_path_factory.mktemp("set"), **SMALL)


@pytest.fixture(scope="module")
def manifest(made: StimulusSet) -> dict:
    return json.loads((made.folder / "manifest.json").read_text(encoding="utf-8"))


def test_the_manifest_states_files_marks_blur_and_light(made: StimulusSet, manifest: dict) -> None:
    check_stimuli(made.folder)
    there = {str(path.relative_to(made.folder)) for path in made.folder.rglob("*") if path.is_file()}
    assert there == {*manifest["files"], "manifest.json"}
    assert "sheet.png" in there
    shown, depth = made.scene("spheres-00"), made.depth("spheres-00")
    for end in FIXATIONS:
        target = shown.target(end)
        x, y = target.position_px
        assert depth[int(y), int(x)] == pytest.approx(target.distance_m, rel=0.01)
    assert shown.nearest.distance_m == pytest.approx(depth[:100].min(), rel=0.02)
    depth = made.depth("spheres-00").astype(float)
    for name, number in LENSES.items():
        for end in FIXATIONS:
            one = made.picture("spheres-00", name, end)
            lens = Lens(0.05, number, one.focus_m)
            diameter = 2 * lens.blur_radius(np.array([depth.min(), depth.max()])) / (FIELD / 128)
            assert one.blur_px[1] == pytest.approx(diameter.max(), rel=1e-6)
            assert one.blur_px[0] == 0  # the plane of focus is in the scene
            assert one.blur_arcmin[1] == pytest.approx(one.blur_px[1] * 60 / made.display.pixels_per_degree)
            assert one.aperture_mm == pytest.approx(1e3 * lens.aperture_diameter)
    one = made.picture("spheres-00", "f/11", "nearest")
    values, light = made.pixels(one), made.linear(one)
    assert (values.dtype, values.shape) == (np.uint8, (128, 128, 3))
    assert np.abs(made.display.encode(light).astype(int) - values).max() == 0
    # A share of the brightest pinhole pixel.
    assert made.linear(made.picture("spheres-00", "pinhole", "nearest")).max() == 1


def test_conditions_differ_in_blur_only(made: StimulusSet, manifest: dict) -> None:
    pinhole = made.linear(made.picture("spheres-00", "pinhole", "nearest"))[..., 1]
    for name in LENSES:
        for end in FIXATIONS:
            light = made.linear(made.picture("spheres-00", name, end))[..., 1]
            assert abs(light.mean() / pinhole.mean() - 1) < 5e-3
            # Blur takes detail away, and the more so the larger the aperture.
            assert np.abs(np.diff(light)).mean() < np.abs(np.diff(pinhole)).mean()
    controls = manifest["controls"]
    assert controls["mean_luminance_percent"]["met"]
    assert controls["shift_px"]["met"]
    assert len(controls["scenes"]["spheres-00"]["pictures"]) == 7
    assert not controls["noise_steps"]["met"]  # of so few rays: the controls say so


def test_the_fixated_object_is_the_sharp_one(made: StimulusSet) -> None:
    shown = made.scene("spheres-00")
    for end in FIXATIONS:
        x, y = (int(place) for place in shown.target(end).position_px)
        part = (slice(y - 3, y + 4), slice(x - 3, x + 4))
        other = "nearest" if end == "farthest" else "farthest"
        here, there = (made.linear(made.picture("spheres-00", "f/5.6", one))[part][..., 1] for one in (end, other))
        assert np.abs(np.diff(here)).mean() > 1.3 * np.abs(np.diff(there)).mean()


def test_the_same_seed_gives_the_same_bytes_and_goes_on_after_an_interruption(
    made: StimulusSet, tmp_path: Path
) -> None:
    def interrupt(share: float, what: str) -> None:
        if "f11-nearest" in what:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_depth_rating(tmp_path, **SMALL, progress=interrupt)
    assert not (tmp_path / "manifest.json").exists()
    with pytest.raises(InputError, match=r"manifest.json cannot be read.*no finished set"):
        read_set(tmp_path)
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.npy")}
    assert {path.name for path in kept} == {"depth.npy", "pinhole.npy", "f22-nearest.npy"}
    make_depth_rating(tmp_path, **SMALL)
    assert (tmp_path / "manifest.json").read_bytes() == (made.folder / "manifest.json").read_bytes()
    assert {path: path.stat().st_mtime_ns for path in kept} == kept  # not made again
    check_stimuli(tmp_path)


def test_a_finished_set_is_verified_and_a_damaged_one_mended(
    made: StimulusSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = (made.folder / "manifest.json").stat().st_mtime_ns
    with monkeypatch.context() as patch:
        patch.setattr(depth_rating, "render", lambda *_, **__: pytest.fail("rendered again"))
        make_depth_rating(made.folder, **SMALL)
    assert (made.folder / "manifest.json").stat().st_mtime_ns == before
    content = (made.folder / "manifest.json").read_bytes()
    (made.folder / "spheres-00" / "f22-farthest.png").write_bytes(b"")
    make_depth_rating(made.folder, **SMALL)
    assert (made.folder / "manifest.json").read_bytes() == content
    check_stimuli(made.folder)


@pytest.mark.slow
def test_colours_carry_the_sign_of_defocus(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of what lies beyond the focus red is the sharper, and blue of what lies before it, as in an eye."""
    monkeypatch.setattr(depth_rating, "APERTURES", {"pinhole": math.inf, "f/22": 22.0})  # fewer, to be quick
    made = make_depth_rating(tmp_path, **SMALL, chromatic=True)
    shown = made.scene("spheres-00")
    for end, sharper in (("nearest", 0), ("farthest", 2)):
        # Where the other object is seen.
        other = shown.farthest if end == "nearest" else shown.nearest
        x, y = (int(place) for place in other.position_px)
        light = made.linear(made.picture("spheres-00", "f/22", end))[y - 8 : y + 9, x - 8 : x + 9]
        detail = np.abs(np.diff(light, axis=1)).mean(axis=(0, 1))
        assert detail.argmax() == sharper
        assert detail.argmin() == 2 - sharper
    pinhole = made.linear(made.picture("spheres-00", "pinhole", "nearest"))
    assert np.array_equal(pinhole[..., 0], pinhole[..., 2])
    # Each colour's blur was foreseen.
    assert made.manifest["controls"]["spectrum_percent"]["worst"] < 15


def test_depth_of_scenes_is_as_much_as_the_check_of_the_display_takes() -> None:
    for world in (depth_rating._plain(seed) for seed in range(20)):
        ends = [1 / world.mark(end).distance for end in FIXATIONS]
        assert ends[0] - ends[1] >= LEAST_DEPTH


@pytest.mark.skipif(variant() is None, reason="no Mitsuba")
def test_path_traced_pictures_are_the_same_to_the_last_bit() -> None:
    world, lens = spheres(2, field=FIELD), Aperture(0.005, 1.5)
    first, second = (render(world, lens, (32, 32), FIELD / 32, engine="path", samples=4, seed=5) for _ in range(2))
    assert np.array_equal(first.colour, second.colour)
    assert np.array_equal(first.residual, second.residual)


def test_without_mitsuba_plain_scenes_are_cast_and_that_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(depth_rating, "variant", lambda: None)
    with pytest.warns(FocalGradientWarning, match="plain spheres are ray cast instead of naturalistic scenes"):
        assert depth_rating._engine("auto") == "cast"
    with pytest.raises(InputError, match="engine 'path' needs, cannot be used here: install it"):
        depth_rating._engine("path")
    assert depth_rating._engine("cast") == "cast"


@pytest.mark.parametrize(
    ("changed", "said"),
    [({"size": 127}, "size is 127, but must be even"), ({"display": Display(distance=5.0)}, "come closer")],
)
def test_bad_input(tmp_path: Path, changed: dict, said: str) -> None:
    with pytest.raises(InputError, match=said):
        make_depth_rating(tmp_path / "set", **{**SMALL, **changed})
    assert not (tmp_path / "set").exists()
