"""Texture counts where it is clear of noise and of what the model's error leaves of the views."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from focalgradient import Lens, View, recover_depth
from focalgradient.depth.equalise.estimate import BY_CHANCE, MISFIT, OVER_ERROR, _informative
from focalgradient.depth.equalise.likelihood import Nodes
from focalgradient.errors import FocalGradientWarning

SQUARES = Path(__file__).parents[2].parent / "shared" / "data" / "printed_squares"


def nodes(texture: float, misfit: float) -> Nodes:
    """A frame of nodes that are all alike."""
    shape = (8, 8)
    one, yes = np.ones(shape), np.ones(shape, bool)
    return Nodes(10 * one, 0.5 * one, misfit * one, texture * one, yes, yes, one)


@pytest.mark.parametrize(
    ("texture", "misfit", "counts"),
    [
        (2, 1.0, True),  # weak texture where noise explains all that is left
        (0.5, 1.0, False),
        (30, 3.4, False),  # a photograph of printed squares
        (250, 1.4, True),  # a photographed flat sheet
        (1000, 3.5, True),  # a hard edge, and a model that errs by a share of its contrast
        (1e6, 1.01 * MISFIT, False),
        (0.99 * OVER_ERROR * (3.0 - BY_CHANCE), 3.0, False),
        (1.01 * OVER_ERROR * (3.0 - BY_CHANCE), 3.0, True),
    ],
)
def test_texture_is_judged_against_misfit(texture: float, misfit: float, counts: bool) -> None:
    assert _informative(nodes(texture, misfit)).all() == counts
    assert _informative(nodes(texture, misfit)).any() == counts


def test_wavebands_have_textures_of_their_own() -> None:
    assert _informative(nodes(30, 3.4), one_waveband=False).all()


@pytest.mark.slow
@pytest.mark.skipif(not SQUARES.exists(), reason="the photographs are not beside the repository (shared/data)")
@pytest.mark.parametrize("centimetres", [50, 150])
@pytest.mark.parametrize("exposure", [1, 2, 3])
def test_printed_squares_of_unknown_focus_are_rejected(centimetres: int, exposure: int) -> None:
    """The mark says 0.25 m; the squares' own blur says that the focus lies elsewhere, and that it is no disc."""
    from focalgradient.photographs import read_photographs

    stops = (16, 10)
    lenses = [Lens(0.018, n, 0.25) for n in stops]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FocalGradientWarning)
        photographs = read_photographs([SQUARES / f"{centimetres}cm-f{n}-{exposure}.jpg" for n in stops], "srgb")
        views = [
            View(photo.luminance, one, 4.7e-6 / one.sensor_distance, mask=photo.mask)
            for photo, one in zip(photographs, lenses, strict=True)
        ]
        depth = recover_depth(views, near=0.25, align=True)
    assert not depth.valid.any()
