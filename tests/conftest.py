"""What several files of tests here begin with; a file's own fixture of the same name goes before."""

import numpy as np
import pytest
from hypothesis import HealthCheck, settings
from two_views import TOML, picture, write

# No test asserts speed: a slow machine must not fail one.
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")


@pytest.fixture(scope="module")
def pictures() -> dict[str, np.ndarray]:
    return {"a.png": picture(16), "b.png": picture(5.6)}


@pytest.fixture
def folder(tmp_path, monkeypatch, pictures):
    """A folder, made the current one, with two pictures and the settings file that names them."""
    for name, pixels in pictures.items():
        write(tmp_path / name, pixels)
    (tmp_path / "views.toml").write_text(TOML)
    monkeypatch.chdir(tmp_path)
    return tmp_path
