"""What the tests of the server begin with: databases, made once for all of them, either store, and a browser."""

from collections.abc import Iterator

import participant
import pytest
from browser import chromium
from databases import FOUND, Cluster, cluster
from playwright.sync_api import Browser


@pytest.fixture(scope="session")
def databases() -> Iterator[Cluster]:
    if FOUND is None:
        pytest.skip("PostgreSQL is missing: install the Debian package postgresql")
    with cluster() as made:
        yield made


@pytest.fixture(params=["folder", pytest.param("postgresql", marks=pytest.mark.slow)])
def store(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Where the answers of a test are kept: each test runs with both."""
    if request.param == "postgresql":
        monkeypatch.setattr(participant, "DATABASE", [request.getfixturevalue("databases").address()])
    return str(request.param)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as made:
        yield made
