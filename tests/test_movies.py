"""Movies: what is written without loss is read back exactly, and a file is there whole or not at all."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import focalgradient as fg
from focalgradient import InputError
from focalgradient.display import Display
from focalgradient.stimuli import frames, slanted_plane
from focalgradient.video import Source, read_movie, save_movie, write_light


def noise(kind: str, shape: tuple[int, ...], count: int) -> list[np.ndarray]:
    random = np.random.default_rng(1)
    return [random.integers(0, np.iinfo(kind).max + 1, shape).astype(kind) for _ in range(count)]


@pytest.mark.parametrize(
    ("ending", "kind", "shape"),
    [
        (".mkv", "uint16", (48, 64)),
        (".mkv", "uint8", (48, 64, 3)),
        (".avi", "uint16", (48, 64)),
        (".avi", "uint8", (48, 64)),
        (".mov", "uint8", (48, 64, 3)),
    ],
)
def test_lossless_movies_are_read_back_exactly(tmp_path: Path, ending: str, kind: str, shape: tuple[int, ...]) -> None:
    frames = noise(kind, shape, 5)
    path = save_movie(iter(frames), tmp_path / f"movie{ending}", rate=85.0)
    found = list(fg.read_movie(path))
    assert [one.dtype for one in found] == [np.dtype(kind)] * 5
    np.testing.assert_array_equal(found, frames)
    with Source(path) as source:
        assert source.fps == pytest.approx(85.0, rel=1e-3)


def test_a_sweep_of_focus_is_a_movie(tmp_path: Path) -> None:
    """Frames of a series and of a stimulus, as light, come back as the display shows them."""
    one = slanted_plane(width_deg=2, height_deg=1.5)
    series = fg.FocusSeries.of(one.sharp, one.depth_m, fg.Lens(0.016, 4.0, 0.57), pixel_angle=one.pixel_angle)
    foci = np.linspace(series.vergences[0], series.vergences[-1], 5)
    path = fg.save_movie((series.at(focus) for focus in foci), tmp_path / "series.mkv", rate=60)
    for frame, focus in zip(fg.read_movie(path), foci, strict=True):
        np.testing.assert_array_equal(frame, series.encoded(focus))
    drawn = list(frames(slanted_plane, "focus_m", (0.5, 0.6), width_deg=2, height_deg=1.5))
    assert np.abs(drawn[0] - drawn[1]).max() > 0.01
    path = fg.save_movie(drawn, tmp_path / "plane.mkv", rate=60)
    np.testing.assert_array_equal(list(fg.read_movie(path)), Display().encode(drawn))


@pytest.mark.parametrize("ending", [".mp4", ".mov", ".mkv", ".avi", ".webm"])
def test_compressed_movies_err_by_some_steps(tmp_path: Path, ending: str) -> None:
    """Smooth pictures, as blurred ones are: in the mean less than 2 steps of 8 bits."""
    x = np.linspace(0, 4 * np.pi, 128)
    frames = [np.uint8(127.5 + 100 * np.outer(np.sin(x + n / 5), np.cos(x))) for n in range(8)]
    found = list(read_movie(save_movie(frames, tmp_path / f"a{ending}", rate=30, lossless=False)))
    errors = [np.abs(one[..., 1].astype(int) - frame).mean() for one, frame in zip(found, frames, strict=True)]
    assert max(errors) < 2


def test_frames_are_taken_one_at_a_time(tmp_path: Path) -> None:
    """200 frames of 0.25 MB: never more than some are in memory."""

    def given_frames() -> Iterator[np.ndarray]:
        for number in range(200):
            yield np.full((500, 500), number % 256, np.uint8)

    told: list[float] = []
    tracemalloc.start()
    path = save_movie(
        given_frames(), tmp_path / "long.mkv", rate=60, count=200, progress=lambda share, words: told.append(share)
    )
    counted = sum(1 for _ in read_movie(path))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert counted == 200
    assert peak < 5e6
    assert told == sorted(told)
    assert told[-1] == 1.0


@pytest.mark.parametrize("error", [KeyboardInterrupt, MemoryError, InputError("no")])
def test_what_is_cut_off_leaves_what_was_there(tmp_path: Path, error: BaseException) -> None:
    def given_frames() -> Iterator[np.ndarray]:
        yield from noise("uint8", (64, 64), 20)
        raise error

    path = tmp_path / "movie.mkv"
    for before in (b"", b"an older movie"):
        if before:
            path.write_bytes(before)
        with pytest.raises(error if isinstance(error, type) else type(error)):
            save_movie(given_frames(), path, rate=60)
        assert [one.name for one in tmp_path.iterdir()] == ["movie.mkv"] * bool(before)
        assert not before or path.read_bytes() == before


GREY = np.zeros((4, 6), np.uint8)


@pytest.mark.parametrize(
    ("frames", "name", "options", "said"),
    [
        ([GREY], "a.gif", {}, "no supported video extension"),
        ([GREY, GREY[:2]], "a.mkv", {}, r"frame 1 is an array of shape \(2, 6\)"),
        ([GREY[:3]], "a.mkv", {}, "frame 0 has 6 x 3 pixels, but video needs even sides"),
        ([GREY + 1.5], "a.mkv", {}, "frame 0 contains radiance outside 0 to 1"),
        ([GREY.astype(np.uint16)], "a.mkv", {"lossless": False}, "16 bits, which only lossless"),
    ],
)
def test_what_is_no_movie_is_refused(tmp_path: Path, frames: list, name: str, options: dict, said: str) -> None:
    with pytest.raises(InputError, match=said) as raised:
        save_movie(frames, tmp_path / name, **{"rate": 60, **options})
    assert "\n" not in str(raised.value)
    assert list(tmp_path.iterdir()) == []


def test_a_movie_that_is_cut_off_is_refused_where_it_ends(tmp_path: Path) -> None:
    path = save_movie(noise("uint8", (64, 64), 40), tmp_path / "a.avi", rate=10)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(InputError, match=r"frame \d+ of .*a.avi could not be decoded"):
        list(read_movie(path))


def test_light_is_written_with_its_brightest_as_white(tmp_path: Path) -> None:
    ramp = np.tile(np.linspace(0, 50, 32), (24, 1))
    write_light(tmp_path / "light.avi", [ramp, ramp[:, ::-1]], 4, repeated=3)
    shown = [frame[:96, :128].astype(float).mean(axis=(0, 2)) for frame in read_movie(tmp_path / "light.avi")]
    assert len(shown) == 6
    assert all(frame[120] > 1.5 * frame[8] for frame in shown[::2])
    assert all(frame[8] > 1.5 * frame[120] for frame in shown[1::2])
