"""The controls find what is not controlled, pictures moved or blurred otherwise, and see through noise."""

import numpy as np
import pytest
from scipy import ndimage

from focalgradient.optics import Aperture
from focalgradient.render.rendered import LUMINANCE
from focalgradient.stimuli.controls import LIMITS, Sharp, against_prediction, judged, spectrum

PIXEL = 1e-3
LENS = Aperture(0.01, 1.0)


def texture(seed: int, shape: tuple[int, int]) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return 0.5 + 0.5 * ndimage.gaussian_filter(rng.standard_normal(shape), 1.5)


def seen(image: np.ndarray, noise: np.ndarray | float = 0.0, sharp: np.ndarray | None = None) -> dict:
    """Controls of a picture of a plane in focus."""
    sharp = image if sharp is None else sharp
    truth = Sharp(np.repeat(sharp[..., None], 3, axis=2), np.zeros(sharp.shape), np.full(sharp.shape, 1.0), PIXEL)
    return against_prediction(image, np.broadcast_to(noise, image.shape), truth, [LENS])


def test_blur_and_colours_are_foreseen() -> None:
    found = seen(texture(1, (96, 128)))
    assert found["shift_px"] == pytest.approx([0, 0], abs=1e-6)
    assert found["spectrum"] == pytest.approx([1] * len(found["spectrum"]), rel=1e-5)
    still = texture(3, (96, 128))
    ratios = seen(ndimage.gaussian_filter(still, 0.8), sharp=still)["spectrum"]
    assert ratios[0] < 0.6
    assert ratios == sorted(ratios)  # the coarser, the less
    still = texture(5, (96, 96))
    lenses = [Aperture(0.01, 1.0 + more) for more in (-0.3, 0.0, 0.3)]
    sharp = Sharp(np.repeat(still[..., None], 3, axis=2), np.zeros(still.shape), np.ones(still.shape), PIXEL)
    ratios = against_prediction(still, np.zeros(still.shape), sharp, lenses)["spectrum"]
    # Only green is foreseen sharp, and the sharp picture has more than that.
    assert 1 / LUMINANCE[1] > ratios[0] > 1.1


@pytest.mark.parametrize("move", [(0.25, 0.0), (0.0, -0.4), (0.3, 0.1)])
def test_a_picture_that_moved_right_and_down(move: tuple[float, float]) -> None:
    still = ndimage.gaussian_filter(texture(2, (96, 128)), 2.5)
    moved = ndimage.shift(still, move[::-1], order=5, mode="nearest")
    assert seen(moved, sharp=still)["shift_px"] == pytest.approx(move, abs=0.03)


def test_what_blur_or_noise_hides_is_left_out() -> None:
    still = texture(6, (20, 24))
    rng = np.random.default_rng(7)
    assert set(seen(still)) == {"shift_px", "spectrum"}
    assert seen(still[:14]) == {}  # too few pixels for an octave
    noise = 3 * rng.standard_normal(still.shape)
    sharp = Sharp(np.repeat(still[..., None], 3, axis=2), noise, np.ones(still.shape), PIXEL)
    assert set(against_prediction(still, np.zeros(still.shape), sharp, [LENS])) == {"shift_px"}


def test_power_of_a_wave_lies_in_its_octave() -> None:
    x = np.arange(128)
    for octave, frequency in enumerate((0.36, 0.18, 0.09, 0.045)):
        power = spectrum(np.sin(2 * np.pi * frequency * x)[:, None] * np.ones(128))
        assert power.argmax() == octave
        assert power[octave] > 20 * np.delete(power, octave).max()


def test_what_is_beyond_its_limit_is_said() -> None:
    good = {"mean_luminance_percent": 0.1, "shift_px": [0.01, 0.0], "spectrum": [1.02, 0.99], "noise_steps": 0.2}
    assert all(one["met"] for one in judged([good, good]).values())
    for name, bad in (
        ("mean_luminance_percent", {"mean_luminance_percent": -0.6}),
        ("shift_px", {"shift_px": [0.08, -0.08]}),
        ("spectrum_percent", {"spectrum": [1.0, 0.85]}),
        ("noise_steps", {"noise_steps": 0.7}),
    ):
        found = judged([good, {**good, **bad}])
        assert [key for key, one in found.items() if not one["met"]] == [name]
        assert found[name]["limit"] == LIMITS[name] < found[name]["worst"]
