"""Pairs out of frames that come lost, damaged or of another size, and depth written as video."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest

from focalgradient import InputError, Lens
from focalgradient.video import (
    DepthStream,
    Frame,
    Pair,
    Scale,
    Skipped,
    Source,
    VideoFile,
    ahead,
    alternation,
    check_frames,
    pairs,
    write_depth,
    write_frames,
)

STEP = np.log(2.0)


def frames(apertures: Sequence[int], numbers: Sequence[int] | None = None) -> list[Frame | Skipped]:
    """A frame for each aperture (0 is twice as detailed as 1), whose first pixel is its true number."""
    numbers = numbers or range(len(apertures))
    return [
        Frame(number, np.array([[true, 100 if aperture == 0 else 50]], np.uint8))
        for true, (number, aperture) in enumerate(zip(numbers, apertures, strict=True))
    ]


def detail(image: np.ndarray) -> float:
    return float(image[0, 1])


def run(items: Sequence[Frame | Skipped], step: float = STEP) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """Which frames were paired, even aperture first, and what was skipped."""
    found = list(pairs(items, detail, step))
    paired = [(int(p.even[0, 0]), int(p.odd[0, 0])) for p in found if isinstance(p, Pair)]
    return paired, [(s.first, s.last) for s in found if isinstance(s, Skipped)]


@pytest.mark.parametrize(
    ("apertures", "step", "paired", "skipped"),
    [
        ([0, 1, 0, 1, 0], STEP, [(0, 1), (2, 1), (2, 3), (4, 3)], []),
        ([0, 1, 0, 0, 1, 0], STEP, [(0, 1), (2, 1), (3, 4), (5, 4)], [(2, 3)]),  # the fourth lost without trace
        ([0, 0, 0], 0.01, [(0, 1), (2, 1)], []),  # apertures that hardly differ
        ([1, 0, 1], -STEP, [(0, 1), (2, 1)], []),  # the blurred aperture first
    ],
)
def test_every_two_successive_frames_make_a_pair(apertures, step, paired, skipped) -> None:
    assert run(frames(apertures), step) == (paired, skipped)


def test_a_frame_lost_beside_a_damaged_one_turns_the_alternation_round() -> None:
    items = frames([0, 1, 0, 1, 1, 0, 1])
    items[4] = Frame(4, np.array([[4, 100]], np.uint8))  # damaged: looks like aperture 0, then 1, 0 where 1, 0 is due
    items[5] = Frame(5, np.array([[5, 100]], np.uint8))
    paired, skipped = run(items)
    assert (4, 5) in skipped
    assert paired[-1] == (5, 6)


def test_undecodable_frames_leave_their_neighbours_with_what_is_left() -> None:
    items = [*frames([0, 1]), Skipped(2, 2, "could not be decoded"), *frames([1, 0], [3, 4])]
    found = list(pairs(items, detail, STEP))
    assert [type(item) for item in found] == [Pair, Skipped, Pair]
    lonely = [*frames([0, 1]), Skipped(2, 2, "x"), *frames([1], [3]), Skipped(4, 4, "x")]
    assert run(lonely)[1] == [(2, 2), (3, 3), (4, 4)]


def test_alternation_survives_a_lost_frame_and_needs_two() -> None:
    assert alternation(frames([0, 1] * 8 + [1, 0]), detail) == pytest.approx(STEP)
    with pytest.raises(InputError, match="no two successive decodable frames"):
        alternation(frames([0]), detail)


def test_frames_worked_out_ahead_keep_their_order_and_their_errors() -> None:
    def counting() -> Iterator[int]:
        yield from range(7)
        raise ValueError("no more")

    found: list[int] = []
    with pytest.raises(ValueError, match="no more"):
        found.extend(ahead(counting()))
    assert found == list(range(7))
    some = ahead(iter(range(100)))
    assert [next(some), next(some)] == [0, 1]
    some.close()


def write_video(path: Path, code: str, pictures: Sequence[np.ndarray]) -> None:
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, cv2.VideoWriter.fourcc(*code), 25, pictures[0].shape[1::-1])
    assert writer.isOpened()
    for picture in pictures:
        writer.write(np.repeat(picture[..., None], 3, axis=2))
    writer.release()


@pytest.fixture
def pictures() -> list[np.ndarray]:
    texture = np.random.default_rng(0).integers(0, 255, (96, 128), np.uint8)
    return [np.roll(texture, n, axis=1) for n in range(12)]


def test_a_video_cut_off_is_read_up_to_there_and_the_rest_reported(tmp_path: Path, pictures: list[np.ndarray]) -> None:
    path = tmp_path / "video.avi"
    write_video(path, "MJPG", pictures)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) * 6 // 10])
    with Source(path) as source:
        found = list(source.frames())
    assert isinstance(found[0], Frame)
    assert isinstance(found[-1], Skipped)
    assert found[-1].last == 11
    assert len(found) - 1 == found[-1].first


@pytest.mark.parametrize("ending", [".mp4", ".avi", ".webm"])
def test_depth_video_can_be_read_back(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"depth{ending}"
    values = np.linspace(0.5, 1.0, 30, dtype=np.float32)[None].repeat(25, axis=0)
    valid = np.ones(values.shape, bool)
    valid[:10] = False
    video = VideoFile(path, 25.0, values.shape, Scale.of_distance(0.5, 1.0))
    for _ in range(5):
        video.write(values, valid)
    video.close()
    capture = cv2.VideoCapture(str(path))
    pictures = []
    while (read := capture.read())[0]:
        pictures.append(read[1])
    assert len(pictures) == 5
    picture = pictures[-1]
    assert picture.shape[0] == 100
    assert picture.shape[1] > 120  # the scale stands beside the picture
    assert picture[:34, :120].mean() < 12  # black: no estimate
    lightness = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)[60:90, :120].mean(axis=0)
    assert lightness[-10:].mean() > lightness[:10].mean() + 60  # near is bright
    assert lightness[:10].mean() > 25  # and the darkest colour is not black


@pytest.mark.parametrize("ending", [".mkv", ".avi"])
def test_a_video_that_lost_frames_is_refused(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"a{ending}"
    noise = np.random.default_rng(1)
    write_frames(path, [noise.integers(0, 255, (64, 64), np.uint8) for _ in range(40)], 10)
    check_frames(path, 40)
    for share in (0.0, 0.3, 0.9):
        torn = tmp_path / f"torn{share}{ending}"
        torn.write_bytes(path.read_bytes()[: round(share * path.stat().st_size)])
        with pytest.raises(InputError, match=r"\d+ of 40 frames of torn"):
            check_frames(torn, 40)


def boards(contrasts: Sequence[int]) -> list[Frame | Skipped]:
    """A checkerboard beside a plain wall, with these contrasts."""
    board = (np.indices((64, 256)).sum(axis=0) % 2 - 0.5) * (np.arange(256) < 128)
    return [Frame(number, (100 + one * board).astype(np.uint8)) for number, one in enumerate(contrasts)]


def test_a_live_stream_is_estimated_frame_by_frame_and_written(tmp_path: Path) -> None:
    """Detail halves from even to odd frames, so the focal disparity is a half; the loss of a frame is reported."""
    live = boards([40, 20, 40, 40, 20])
    stream = DepthStream(live, encoding="linear")
    assert stream.even_is_sharper
    told: list[str] = []
    counts = write_depth(
        *(stream, iter(live), tmp_path / "depth.mkv", tmp_path / "depth.npy"),
        fps=25,
        count=5,
        progress=lambda share, frame: told.append(f"{share:g} {frame}"),
    )
    assert (counts.frames_read, counts.depth_frames, counts.frames_with_depth) == (5, 3, 3)
    assert [str(one) for one in counts.skipped] == [
        "frames 2 to 3 show the same aperture, so that a frame between them was lost"
    ]
    values = np.load(tmp_path / "depth.npy")
    assert values.shape == (3, 16, 64)
    np.testing.assert_allclose(values[:, 2:14, 2:28], 0.5, atol=0.03)
    assert np.isnan(values[:, :, 40:]).all()
    assert told[-1] == "1 frame 4"


@pytest.mark.parametrize(
    ("f_numbers", "limits", "sentence"),
    [
        ((), {"near": 1.0}, "near and far limit distance, which needs the optics"),
        ((16, 4), {"near": 2.0, "far": 1.0}, "near 2 lies beyond or at far 1"),
        ((4, 16), {"near": 1.0}, "even frames are sharper, but f_number gives them the larger aperture"),
        ((16, 16), {"near": 1.0}, "both apertures are equal"),
    ],
)
def test_a_stream_that_contradicts_its_optics_is_refused(f_numbers, limits, sentence: str) -> None:
    lenses = [Lens(0.025, number, 1.0) for number in f_numbers] or None
    with pytest.raises(InputError, match=sentence):
        DepthStream(boards([40, 20, 40]), lenses, 3e-4 if lenses else None, encoding="linear", **limits)
