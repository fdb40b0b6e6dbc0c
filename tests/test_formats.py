"""Formats of images and videos: only those that are documented are decoded, whatever a file's name says."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from focalgradient.errors import InputError
from focalgradient.photographs import read_photograph, read_picture

PIXELS = np.random.default_rng(1).integers(20, 200, (24, 32, 3), np.uint8)
WANTED, OTHERS = ("PNG", "TIFF", "JPEG"), ("BMP", "GIF", "WEBP", "PPM", "PCX", "TGA", "JPEG2000", "SGI")


@pytest.mark.parametrize("name", WANTED)
def test_formats_that_are_documented_are_read(tmp_path: Path, name: str) -> None:
    Image.fromarray(PIXELS).save(tmp_path / "a.png", format=name, **({"quality": 95} if name == "JPEG" else {}))
    assert read_photograph(tmp_path / "a.png").luminance.shape == (24, 32)


@pytest.mark.parametrize("name", OTHERS)
@pytest.mark.parametrize("read", [read_photograph, read_picture])
def test_other_formats_are_refused(tmp_path: Path, name: str, read: object) -> None:
    path = tmp_path / "a.png"
    Image.fromarray(PIXELS).save(path, format=name)
    assert callable(read)
    with pytest.raises(InputError, match="expected an intact PNG, TIFF, JPEG"):
        read(path)


def test_every_image_is_opened_with_its_formats_named() -> None:
    source = Path(__file__).parents[1] / "src"
    calls = [text for path in source.rglob("*.py") for text in path.read_text().split("Image.open(")[1:]]
    assert calls
    for text in calls:
        assert "formats=" in text.split(") as image")[0], text[:80]
