"""Views in different wavebands, and optics with a transfer of their own: what the core makes of any of them."""

from dataclasses import dataclass

import numpy as np
import pytest

from focalgradient import FocalGradientWarning, View, recover_depth
from focalgradient.depth import search as search_module
from focalgradient.depth.equalise.likelihood import SharedPower, comparing_filters
from focalgradient.depth.equalise.wavebands import BandGains, common_error
from focalgradient.depth.filters import RADII
from focalgradient.depth.read import parabola_minimum
from focalgradient.depth.search import BANDS_STEP, Search
from focalgradient.depth.settings import OPTICS
from focalgradient.psf import disc_transfer

PIXEL = 3e-4


@dataclass(frozen=True)
class Tinted:
    """A lens with a transfer and a waveband of its own."""

    focus_vergence: float
    light: str = "green"
    aperture_diameter: float = 0.004

    def transfer(self, frequency, vergence):
        return disc_transfer(frequency, np.abs(self.focus_vergence - vergence) * self.aperture_diameter / 2)


def views(*optics: Tinted, noise: float = 0.0, vergence: float = 1.3, mix: float = 0.0) -> list[View]:
    """A wall whose texture, in other wavebands than the first's, has a part of its own of `mix` times the amplitude."""
    random = np.random.default_rng(3)
    frequency = np.hypot(np.fft.fftfreq(384)[:, None], np.fft.rfftfreq(384))
    fields = np.fft.rfft2(random.standard_normal((2, 384, 384))) / np.maximum(frequency, 1 / 384)
    fields[:, 0, 0] = 0
    seen = []
    for one in optics:
        field = fields[0] + (mix * fields[1] if one.light != optics[0].light else 0)
        image = np.fft.irfft2(field * one.transfer(frequency / PIXEL, vergence))[64:320, 64:320]
        image = 1 + 0.2 * image / np.fft.irfft2(fields[0]).std() + noise * random.standard_normal(image.shape)
        seen.append(View(image.astype(np.float32), one, PIXEL))
    return seen


def test_optics_own_disc_gives_the_depth_of_the_disc() -> None:
    pair = views(Tinted(1.0), Tinted(1.6), noise=0.01)
    own = recover_depth(pair, psf="optics")
    with pytest.warns(FocalGradientWarning, match="taken for a disc, as asked for"):
        disc = recover_depth(pair, psf="disc")
    assert np.array_equal(own.vergence, disc.vergence)
    assert np.median(np.abs(own.vergence - 1.3)[own.valid]) < 0.01


def test_what_wavebands_share_is_estimated_and_of_one_waveband_nothing(monkeypatch) -> None:
    monkeypatch.setattr(search_module, "OWN_STEP", BANDS_STEP)  # levels as far apart for either: sd depends on it
    alike = recover_depth(views(Tinted(1.0), Tinted(1.6), noise=0.01), psf="optics")
    assert "shared_texture" not in alike.details
    unlike = recover_depth(views(Tinted(1.0), Tinted(1.6, "blue"), noise=0.01, mix=0.3), psf="optics")
    shared = unlike.details["shared_texture"]["blue"]
    # Midway between the foci, where both views are blurred alike, the gain is hardest to estimate, and needed least.
    assert shared["gain"] == pytest.approx(1, abs=0.1)
    assert shared["correlation"] == pytest.approx(1 / np.hypot(1, 0.3), abs=0.04)
    assert np.median(np.abs(unlike.vergence - 1.3)[unlike.valid]) < 0.01
    assert np.median(unlike.vergence_sd) > 1.5 * np.median(alike.vergence_sd)


def test_filters_let_none_of_the_shared_texture_through_and_own_parts_as_noise() -> None:
    """At the right depth what is left is noise of the strength stated, own parts included."""
    search = Search.over([Tinted(1.0), Tinted(1.6, "blue"), Tinted(0.8, "blue")], PIXEL, None, None)
    blurs, power = search.blurs(OPTICS), 1e-2 / np.maximum(RADII, RADII[1]) ** 2
    shared_power = SharedPower(np.array([0, 1, 1]), np.array([1.0, 0.8, 0.8]), np.array([0.0, 0.2]), np.zeros(3))
    sd = [0.01, 0.02, 0.02]
    filters, own = comparing_filters(blurs, sd, power, shared_power)
    passed = (blurs.pass_band > 1 - 1e-9).all(axis=0)
    shown = blurs.transfer * shared_power.gain[:, None, None] / np.array(sd)[:, None, None]
    covariance = np.eye(3)[:, :, None, None] + own[0][:, None] * own[0][None]
    left = np.einsum("anlf,nmlf,bmlf->ablf", filters, covariance, filters)
    for rows in filters:
        assert np.abs((rows * shown).sum(axis=0))[passed].max() < 1e-3
    # Two comparisons, of one strength and unrelated.
    assert np.abs(left[0, 1])[passed].max() < 1e-6
    assert left[0, 0][passed] == pytest.approx(left[1, 1][passed], abs=1e-6)


@pytest.mark.parametrize("share", [0.3, 0.8])
def test_a_gain_that_is_off_moves_the_least_cost_by_the_common_error(share: float) -> None:
    """A blue view 0.5 % brighter than assumed, of which 5 % are stated: a tenth of the stated error."""
    search = Search.over([Tinted(1.0), Tinted(1.6, "blue")], PIXEL, None, None)
    blurs, power = search.blurs(OPTICS), 1e-2 / np.maximum(RADII, RADII[1]) ** 2
    shared = SharedPower(np.array([0, 1]), np.array([1.0, 0.8]), np.zeros(2), np.zeros(2))
    gains = BandGains(shared, [0.01, 0.02], np.array([0.0, 0.03]), power, np.array([0.0, 0.04]))
    (filters,), _ = comparing_filters(blurs, gains.noise_sd, power, shared)
    at = round(share * filters.shape[1])
    places = []
    for off in (1.005, 0.995):
        seen = blurs.transfer[:, at] * np.array([[1.0], [0.8 * off]]) / gains.assumed_sd[:, None]
        cost = np.abs((filters * seen[:, None]).sum(axis=0)) ** 2 @ (power * blurs.frequencies.areas)
        places.append(parabola_minimum(cost)[0])
    assert abs(np.diff(places)[0]) / 2 == pytest.approx(
        common_error(gains, blurs)[at] / 10, rel=0.15
    )  # both by differences of levels
