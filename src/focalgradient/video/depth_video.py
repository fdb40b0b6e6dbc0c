"""Depth written as colour video with a scale, and as numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from focalgradient.video.reading import check_frames
from focalgradient.video.writing import check_ending, encoder

__all__ = ["Scale", "ValuesFile", "VideoFile", "write_light"]

OMITTED_DARK_COLOURS = 40
"""Number of colours omitted at the dark end of the colour map, to distinguish it from missing values (black)."""


@dataclass(frozen=True, slots=True)
class Scale:
    """Colour scale: linear from `dark` to `bright`, with `ticks` (value, label) and a `title`."""

    dark: float
    bright: float
    ticks: tuple[tuple[float, str], ...]
    title: str

    @classmethod
    def of_distance(cls, far: float, near: float) -> Scale:
        """Return a scale linear in vergence from `far` to `near` (D), near bright, with labels in metres.

        >>> [label for _, label in Scale.of_distance(0.5, 1.0).ticks]
        ['2', '1.6', '1.33', '1.14', '1']
        """
        values = np.linspace(far, near, 5)
        labels = ["inf" if value <= 0 else f"{1 / value:.3g}" for value in values]
        return cls(far, near, tuple(zip(values.tolist(), labels, strict=True)), "distance, m")

    @classmethod
    def of_light(cls) -> Scale:
        """Return a scale of encoded light from 0 to 1."""
        return cls(0.0, 1.0, ((0.0, "0"), (0.5, "0.5"), (1.0, "1")), "light")

    @classmethod
    def of_disparity(cls) -> Scale:
        """Return a scale of focal disparity from 0 (dark: blurred) to 1 (bright: in focus)."""
        return cls(0.0, 1.0, tuple((value / 4, f"{value / 4:.2f}") for value in range(5)), "focal disparity")


class VideoFile:
    """Colour video of maps on a grid of 4 x 4 pixels; black where there is no value.

    Parameters
    ----------
    path
        Output path; its extension determines the file format.
    fps
        Frames per second.
    shape
        Height and width of the grid; each value covers 4 x 4 pixels.
    scale
        Colour scale, drawn on the right of every frame.

    Raises
    ------
    InputError
        If the extension is not supported, or the encoder fails.
    """

    def __init__(self, path: Path, fps: float, shape: tuple[int, int], scale: Scale) -> None:
        check_ending(path)
        colours = cv2.applyColorMap(np.arange(256, dtype=np.uint8)[:, None], cv2.COLORMAP_VIRIDIS)[:, 0]
        places = np.rint(np.linspace(OMITTED_DARK_COLOURS, 255, 255)).astype(int)
        self._colours = np.concatenate([np.zeros((1, 3), np.uint8), colours[places]])
        self._scale = scale
        height, width = (4 * n for n in shape)
        panel = _panel(height + height % 2, scale, self._colours)
        self._picture = np.zeros((panel.shape[0], width + panel.shape[1], 3), np.uint8)
        self._picture[:, width:] = panel
        self._part = self._picture[:height, :width]
        self._path, self._frames = path, 0
        self._writer = encoder(path, path.name, "", fps, self._picture.shape[:2])

    def write(self, values: NDArray[np.floating], valid: NDArray[np.bool_]) -> None:
        """Write a frame: `values` on the grid, drawn where `valid`."""
        share = (values - self._scale.dark) / (self._scale.bright - self._scale.dark)
        place = np.where(valid, 1 + 254 * np.clip(share, 0, 1), 0).astype(np.uint8)
        colours = cv2.applyColorMap(place, self._colours[:, None])
        self._part[:] = cv2.resize(colours, self._part.shape[1::-1], interpolation=cv2.INTER_NEAREST)
        self._writer.write(self._picture)
        self._frames += 1

    def close(self) -> None:
        """Close the file and verify it with `check_frames`."""
        self._writer.release()
        check_frames(self._path, self._frames)


def write_light(path: Path, images: Sequence[NDArray[np.floating]], fps: float, *, repeated: int = 1) -> None:
    """Write linear radiance as colour video.

    Parameters
    ----------
    path
        Output path; its extension determines the file format.
    images
        Frames of one shape, H x W: with the 99.7th percentile of all as white and a gamma of 2.2.
    fps
        Frames per second.
    repeated
        Number of times that the frames are shown one after another.

    Raises
    ------
    InputError
        If the extension is not supported, or the encoder fails.
    """
    white = float(np.percentile(np.asarray(images), 99.7))
    shape = images[0].shape
    file = VideoFile(path, fps, (shape[0], shape[1]), Scale.of_light())
    try:
        for image in [*images] * repeated:
            file.write((image / white) ** (1 / 2.2), np.ones(shape, np.bool_))
    finally:
        file.close()


class ValuesFile:
    """Frames of numbers appended to a ``.npy`` file (float32, n x h x w), whose header is completed on closing.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = ValuesFile(Path(folder, "values.npy"), (2, 3))
    ...     file.write(np.ones((2, 3)))
    ...     file.close()
    ...     np.load(Path(folder, "values.npy")).shape
    (1, 2, 3)
    """

    def __init__(self, path: Path, shape: tuple[int, int]) -> None:
        self._file = path.open("wb")
        self._shape = shape
        self._frames = 0
        self._write_header()

    def _write_header(self) -> None:
        # NumPy pads headers, so that the number of frames can be updated in place.
        shape = (self._frames, *self._shape)
        header: dict[str, Any] = {"descr": "<f4", "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(self._file, header)  # type: ignore[no-untyped-call]

    def write(self, values: NDArray[np.floating]) -> None:
        """Append one frame of the file's shape."""
        self._file.write(np.ascontiguousarray(values, "<f4").tobytes())
        self._frames += 1

    def close(self) -> None:
        """Write the number of frames into the header, and close the file."""
        self._file.seek(0)
        self._write_header()
        self._file.close()


def _panel(height: int, scale: Scale, colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a panel with the scale and its numbers, as tall as the picture; without numbers if too low for text."""
    size = float(np.clip(height / 720, 0.35, 1.5))
    thick = max(1, round(1.5 * size))
    font = cv2.FONT_HERSHEY_SIMPLEX
    title = scale.title.split(" ")  # one word per line in the narrow panel
    texts = [*title, *(label for _, label in scale.ticks)]
    wide = max(cv2.getTextSize(text, font, size, thick)[0][0] for text in texts)
    line = round(34 * size)
    bar, gap = round(28 * size), round(10 * size)
    width = bar + 3 * gap + wide
    width += width % 2
    panel = np.full((height, width, 3), 40, np.uint8)
    top, bottom = round((len(title) + 0.8) * line), height - line
    if bottom - top < line:  # no room for text
        panel[:, gap : gap + bar] = colours[np.linspace(255, 1, height).round().astype(int)][:, None]
        return panel
    for number, text in enumerate(title, 1):
        cv2.putText(panel, text, (gap, number * line), font, size, (255, 255, 255), thick, cv2.LINE_AA)
    panel[top:bottom, gap : gap + bar] = colours[np.linspace(255, 1, bottom - top).round().astype(int)][:, None]
    for value, label in scale.ticks:
        share = (value - scale.dark) / (scale.bright - scale.dark)
        y = round(top + (1 - share) * (bottom - top - 1))
        cv2.line(panel, (gap + bar, y), (gap + bar + gap // 2, y), (255, 255, 255), thick)
        place = gap + bar + gap, y + round(9 * size)
        cv2.putText(panel, label, place, font, size, (255, 255, 255), thick, cv2.LINE_AA)
    return panel
