"""Texture counts where it is clear of noise and of what the model's error leaves of the views."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from textures import natural

from focalgradient import Lens, View, recover_depth
from focalgradient.depth.equalise.likelihood import Nodes
from focalgradient.depth.equalise.signal import are_compressed, informative_nodes, left_on_blank

SQUARES = Path(__file__).parents[2].parent / "shared" / "data" / "printed_squares"


def nodes(texture: float, misfit: float) -> Nodes:
    """A frame of nodes that are all alike."""
    shape = (8, 8)
    one, yes = np.ones(shape), np.ones(shape, bool)
    return Nodes(10 * one, 0.5 * one, misfit * one, texture * one, yes, yes, one, yes)


@pytest.mark.parametrize(
    ("texture", "misfit", "counts"),
    [
        (2, 1.0, True),  # weak texture where noise explains all that is left
        (0.5, 1.0, False),
        (30, 3.4, False),  # a photograph of printed squares
        (250, 1.4, True),  # a photographed flat sheet
        (1000, 3.5, True),  # a hard edge, and a model that errs by a share of its contrast
    ],
)
def test_texture_is_judged_against_misfit(texture: float, misfit: float, counts: bool) -> None:
    assert informative_nodes(nodes(texture, misfit)).all() == counts
    assert informative_nodes(nodes(texture, misfit)).any() == counts


def test_outlines_that_contradict_every_depth_are_no_uneven_noise() -> None:
    """A tenth of the frame about outlines fits no depth; weak texture elsewhere counts all the same."""
    frame = nodes(3, 1.0)
    about = np.arange(64).reshape(8, 8) < 7
    informative = informative_nodes(replace(frame, misfit=np.where(about, 9.0, 1.0)))
    assert informative[~about].all()
    assert not informative[about].any()
    uneven = np.where(np.arange(64).reshape(8, 8) % 2, 0.5, 2.5)  # blank paper stored with loss is uneven all over
    assert not informative_nodes(replace(frame, misfit=uneven)).any()
    for role in ("unambiguous", "inside", "curved_by_depth"):  # each is needed
        assert not informative_nodes(replace(frame, **{role: np.zeros((8, 8), bool)})).any()  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("share", "misfit", "left"),
    [(0.1, 0.2, 0.2), (0.1, 3.0, 3.0), (0.1, 0.8, None), (0.1, 1.8, None), (0.4, 0.2, 0.2), (0.4, 3.0, None)],
)
def test_noise_of_a_blank_frame_that_is_not_the_estimate_is_found(
    share: float, misfit: float, left: float | None
) -> None:
    informative = np.arange(64).reshape(8, 8) < share * 64
    even = np.random.default_rng(0).standard_normal((64, 64)).astype(np.float32)
    blocks = np.kron(even[:8, :8], np.ones((8, 8), np.float32))
    assert left_on_blank(nodes(30, misfit), informative, [blocks]) == left
    if misfit < 1:  # without blocks, what is left is less because noise is taken for more than it is
        squares = np.kron(even[:3, :3], np.ones((24, 24), np.float32))[:64, :64]  # steps at every third block
        for image in (even, squares + even / 4):
            assert left_on_blank(nodes(30, misfit), informative, [image]) is None


def test_compression_shows_in_textured_views() -> None:
    """Blurred natural texture in JPEG of quality 75, whose blocks are faint, and the same without loss."""
    import cv2

    blurred = gaussian_filter(natural((256, 256)), 1.5)
    pixels = np.clip(125 * blurred, 0, 255).astype(np.uint8)
    stored = cv2.imdecode(cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, 75])[1], cv2.IMREAD_GRAYSCALE)
    assert not are_compressed([pixels.astype(np.float32)])
    assert are_compressed([pixels.astype(np.float32), stored.astype(np.float32)])


@pytest.mark.slow
@pytest.mark.skipif(not SQUARES.exists(), reason="the photographs are not beside the repository (shared/data)")
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("centimetres", [50, 150])
@pytest.mark.parametrize("exposure", [1, 3])
def test_printed_squares_of_unknown_focus_are_rejected(centimetres: int, exposure: int) -> None:
    """The mark says 0.25 m; the squares' own blur says that the focus lies elsewhere, and that it is no disc."""
    from focalgradient.photographs import read_photographs

    stops = (16, 10)
    lenses = [Lens(0.018, n, 0.25) for n in stops]
    photographs = read_photographs([SQUARES / f"{centimetres}cm-f{n}-{exposure}.jpg" for n in stops], "srgb")
    views = [
        View(photo.luminance, one, 4.7e-6 / one.sensor_distance, mask=photo.mask)
        for photo, one in zip(photographs, lenses, strict=True)
    ]
    assert not recover_depth(views, near=0.25, align=True).valid.any()
