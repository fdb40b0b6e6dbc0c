"""A small set of pictures for observers to look at, and its encoded stimuli."""

import pytest

from focalgradient.design import DepthRatingDesign
from focalgradient.display import Display
from focalgradient.observers import encoded_stimuli, pictures
from focalgradient.stimuli import make_depth_rating


@pytest.fixture(scope="session")
def design():
    return DepthRatingDesign(scenes=["spheres-01"], repetitions=1, catch_trials=1, practice_trials=1, break_every=0)


@pytest.fixture(scope="session")
def stimuli(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pictures") / "set"
    return make_depth_rating(folder, scenes=2, size=160, engine="cast", samples=16, display=Display(pixel_pitch=0.8e-3))


@pytest.fixture(scope="session")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="session")
def encoded(stimuli, cache):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(pictures.CACHE, str(cache))
        return encoded_stimuli(stimuli)
