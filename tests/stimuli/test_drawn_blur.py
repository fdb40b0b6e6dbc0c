"""Drawn stimuli: blur is as set, compared with independent code, and nothing is sharper than its blur allows."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.ndimage import convolve, gaussian_filter, map_coordinates
from scipy.stats import norm, qmc

from focalgradient.psf import Polygon, Psf
from focalgradient.stimuli import blurred_edge, dead_leaves, slanted_plane, texture_border, wide_field
from focalgradient.stimuli.layers import noise


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("psf", ["gaussian", "disc", Polygon(5, rotation=0.3)], ids=str)
def test_each_texture_has_the_blur_that_was_set(side: str, psf: str | Psf) -> None:
    """Away from the border the picture is the sharp one convolved with the blur, sampled in space."""
    blurs = {"left_blur_arcmin": 4.0, "right_blur_arcmin": 6.0}
    one = texture_border(**blurs, psf=psf, slope=1.2, border="straight", seed=3)
    sd = one.blur_px[:, 5 if side == "left" else -5][0]
    if psf == "gaussian":
        expected = gaussian_filter(one.sharp, sd, mode="wrap", truncate=6)
    else:
        fine = (np.arange(-20, 21)[:, None] + (np.arange(16) + 0.5) / 16 - 0.5).ravel()
        inside = np.hypot(fine[:, None], fine) <= 2 * sd
        if isinstance(psf, Polygon):  # of odd blades: turned by half a turn in front of the focus
            down, right = np.moveaxis((1 if side == "right" else -1) * psf.corners() * sd / psf.sd_per_radius, 1, 0)
            over, along = np.roll(right, -1) - right, np.roll(down, -1) - down
            across = along * (fine[:, None] - right) - over * (fine[:, None, None] - down)
            inside = (across <= 0).all(axis=-1)
        disc = inside.reshape(41, 16, 41, 16).mean(axis=(1, 3))
        expected = convolve(one.sharp, disc / disc.sum(), mode="wrap")
    inside = np.s_[40:-40, 40:88] if side == "left" else np.s_[40:-40, -88:-40]
    error = (one.picture - expected)[inside]
    assert error.std() < (1e-4 if psf == "gaussian" else 2e-3) * one.sharp.std() * 5
    assert one.picture[inside].std() < 0.9 * one.sharp[inside].std()


@pytest.mark.parametrize("blur", [0.5, 2.0, 6.0])
def test_the_border_has_the_blur_that_was_set(blur: float) -> None:
    one = texture_border(
        left_blur_arcmin=0, right_blur_arcmin=0, border_blur_arcmin=blur, border="straight", near="left"
    )
    left, right = (0.5 * (1 + 0.2 * noise(one.shape, [0, number], 1.0)) for number in (0, 1))
    covered = np.where(np.abs(left - right) > 0.05, (one.picture - right) / (left - right), np.nan)
    sd = blur * 32 / 60
    place = 128 - (np.arange(256) + 0.5)
    expected = np.mean([norm.cdf((place + part) / sd) for part in (np.arange(64) + 0.5) / 64 - 0.5], axis=0)
    np.testing.assert_allclose(np.nanmedian(covered, axis=0), expected, atol=0.01)


def test_uniform_layers_leave_no_trace_of_a_border() -> None:
    for blur in (None, 0.0, 1.0, 5.0):
        one = texture_border(contrast=0.0, left_blur_arcmin=3.0, border_blur_arcmin=blur)
        np.testing.assert_allclose(one.picture, 0.5, atol=1e-9)


def test_a_near_blurred_surface_over_a_far_sharp_one_is_what_rays_through_the_pupil_see() -> None:
    """1,024 rays a pixel: each meets the near surface where the ray crosses it, or else the far one in focus."""
    given = {"width_deg": 2, "height_deg": 2, "slope": 2.0, "period_deg": 1.0, "amplitude_deg": 0.2, "seed": 5}
    one = texture_border(left_blur_arcmin=6.0, right_blur_arcmin=0.0, near="left", **given)
    sd, side = 6 * 32 / 60, one.shape[0]
    near, far = (0.5 * (1 + 0.2 * noise(one.shape, [5, number], 2.0)) for number in (0, 1))
    offsets = norm.ppf(qmc.Sobol(2, seed=1).random(1024)) * sd
    y, x = np.indices(one.shape).astype(float)
    seen = np.zeros(one.shape)
    for dy, dx in offsets:
        light = map_coordinates(near, [y + dy, x + dx], order=3, mode="grid-wrap")
        border = side / 2 + 0.2 * 32 * np.sin(2 * np.pi / 32 * (y + dy + 0.5 - side / 2))
        covered = np.clip(border - (x + dx), 0, 1)
        seen += covered * light + (1 - covered) * far
    error = (seen / len(offsets) - one.picture) / 0.5
    assert np.abs(error).max() < 0.01
    assert error.std() < 0.002


@pytest.mark.parametrize("psf", ["gaussian", "disc", Polygon(5)], ids=str)
@pytest.mark.parametrize("turn", [0.0, 30.0, 90.0])
def test_an_edge_has_the_blur_that_was_set(psf: str | Psf, turn: float) -> None:
    one = blurred_edge(pedestal_arcmin=2.0, increment_arcmin=3.0, psf=psf, orientation_deg=turn)
    turned = blurred_edge(pedestal_arcmin=5.0, psf=psf, orientation_deg=turn, side="nearer")
    np.testing.assert_allclose(turned.picture[::-1, ::-1], 1 - one.picture, atol=1e-9)
    down, right = np.indices(one.shape) - (one.shape[0] - 1) / 2
    place = (right * np.cos(np.radians(turn)) + down * np.sin(np.radians(turn))).ravel()
    share = (one.picture.ravel() - 0.25) / 0.5
    order = np.argsort(place)
    place, share = place[order], share[order]
    mass = np.diff(share) / np.sum(np.diff(share))
    middle = (place[1:] + place[:-1]) / 2
    variance = np.sum(mass * middle**2) - np.sum(mass * middle) ** 2
    assert np.sqrt(variance) == pytest.approx(5.0, rel=0.02)  # 60 pixels per degree
    assert share[0] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("psf", ["gaussian", Polygon(3)], ids=str)
def test_leaves_of_one_blur_are_the_sharp_leaves_blurred(psf: str | Psf) -> None:
    one = dead_leaves(blurs_arcmin=(6.0,), width_deg=6, height_deg=6, seed=2, psf=psf, side="nearer", focus_m=0.5)
    sd = 6 * 32 / 60
    expected = gaussian_filter(one.sharp, sd, truncate=6)
    if isinstance(psf, Polygon):
        frequencies = np.fft.fftfreq(one.shape[0])[:, None], np.fft.fftfreq(one.shape[1])
        otf = np.conj(psf.optical_transfer(*frequencies, sd / psf.sd_per_radius))
        expected = np.fft.ifft2(np.fft.fft2(one.sharp) * otf).real
    inside = np.s_[20:-20, 20:-20]
    np.testing.assert_allclose(one.picture[inside], expected[inside], atol=4e-3)


def test_leaves_in_front_that_are_in_focus_stay_sharp_and_blurred_ones_never_bleed_onto_them() -> None:
    one = dead_leaves(blurs_arcmin=(5.0, 0.0), order="depth", width_deg=6, height_deg=6, seed=4)
    front = one.masks["0 arcmin"]
    clear = np.abs(one.picture - one.sharp)
    assert np.mean(clear[front] < 2e-3) > 0.9  # all but the pixels of their own edges
    assert front.mean() == pytest.approx(0.5, abs=0.12)
    assert one.depth_m[front].max() < one.depth_m[~front].min()


@settings(max_examples=12, deadline=None)
@example(left=0.0, right=8.0, edge=8.0, psf="disc", border="straight", seed=1)  # a sharp side shows through the border
@given(
    left=st.floats(0, 8),
    right=st.floats(0, 8),
    edge=st.none() | st.floats(0, 8),
    psf=st.sampled_from(["gaussian", "disc", "annulus", Polygon(5)]),
    border=st.sampled_from(["straight", "sinusoidal"]),
    seed=st.integers(0, 99),
)
def test_no_place_of_a_border_is_sharper_than_its_blur_allows(
    left: float, right: float, edge: float | None, psf: Any, border: Any, seed: int
) -> None:
    one = texture_border(
        left_blur_arcmin=left,
        right_blur_arcmin=right,
        border_blur_arcmin=edge,
        psf=psf,
        border=border,
        seed=seed,
        width_deg=4,
        height_deg=3,
        pupil_mm=8,
    )
    assert one.controlled["sharpest"] <= 1.0
    span = np.ptp(one.sharp) / 2
    assert one.picture.min() >= 0.5 - 1.7 * span
    assert one.picture.max() <= 0.5 + 1.7 * span


@settings(max_examples=6, deadline=None)
@given(eccentricity=st.floats(0, 3.4), pedestal=st.floats(0, 10), increment=st.floats(0, 10), seed=st.integers(0, 99))
def test_no_place_of_a_wide_field_is_sharper_than_its_blur_allows(
    eccentricity: float, pedestal: float, increment: float, seed: int
) -> None:
    one = wide_field(
        eccentricity_deg=eccentricity,
        pedestal_arcmin=pedestal,
        increment_arcmin=increment,
        seed=seed,
        window_deg=12,
        pixels_per_degree=10,
        side="nearer",
    )
    assert one.controlled["sharpest"] <= 1.0


def test_a_wide_field_is_sharp_but_in_its_annulus_and_blurred_there_as_set_in_visual_angle() -> None:
    one = wide_field(
        eccentricity_deg=12, pedestal_arcmin=8, increment_arcmin=8, pixels_per_degree=8, smallest_deg=0.8, pupil_mm=8
    )
    far = np.degrees(np.arctan(np.hypot(*(np.indices(one.shape) - (one.shape[0] - 1) / 2)) * one.pixel_angle))
    sharp = np.abs(far - 12) > 2 + 0.26
    np.testing.assert_array_equal(one.picture[sharp], one.sharp[sharp])
    ring = (np.abs(far - 12) < 1.7) & ~one.masks["target"]
    # A pixel at 12 degrees subtends cos^2 along the radius and cos across: cos^1.5 on average.
    sd = 8 / 60 * 8 / np.cos(np.radians(12)) ** 1.5
    blurred = gaussian_filter(one.sharp, sd, truncate=6)
    away = ring & (np.roll(ring, 6, 0) & np.roll(ring, -6, 0) & np.roll(ring, 6, 1) & np.roll(ring, -6, 1))
    np.testing.assert_allclose(one.picture[away], blurred[away], atol=4e-3)
    assert one.masks["target"].sum() / one.masks["annulus"].sum() == pytest.approx(0.25, abs=0.01)


@pytest.mark.parametrize(("slant", "tilt"), [(60.0, 90.0), (70.0, 0.0), (65.0, 210.0)])
def test_a_slanted_plane_is_what_rays_through_the_pupil_see(slant: float, tilt: float) -> None:
    """Vergence is linear in the picture: where a ray meets the plane is known in closed form."""
    one = slanted_plane(slant_deg=slant, tilt_deg=tilt, distance_m=0.3, pupil_mm=24, width_deg=6, height_deg=6)
    assert one.blur_px.max() > 2.5
    t, slope = np.radians(tilt), np.tan(np.radians(slant))
    across, down = slope * np.cos(t) / 0.3, -slope * np.sin(t) / 0.3  # vergence = 1 / 0.3 - across x - down y
    points = np.sqrt((np.arange(150) + 0.5) / 150), np.arange(150) * np.pi * (3 - np.sqrt(5))
    height, width = one.shape
    y, x = (np.indices(one.shape) - [[[(height - 1) / 2]], [[(width - 1) / 2]]]) * one.pixel_angle
    seen = np.zeros(one.shape)
    for radius, angle in zip(*points, strict=True):
        u, v = 0.012 * radius * np.cos(angle), 0.012 * radius * np.sin(angle)
        # From x' = x + u D and y' = y + v D, where the defocus D = across x' + down y' there:
        defocus = (across * x + down * y) / (1 - across * u - down * v)
        at = [
            (y + v * defocus) / one.pixel_angle + (height - 1) / 2,
            (x + u * defocus) / one.pixel_angle + (width - 1) / 2,
        ]
        seen += map_coordinates(one.sharp, at, order=3, mode="mirror") / 150
    inside = np.s_[20:-20, 20:-20]
    error = (seen - one.picture)[inside] / 0.5
    assert error.std() < 0.006
    assert np.abs(error).max() < 0.04
