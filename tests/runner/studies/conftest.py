"""A cache of stimuli of each test's own."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def cache_of_its_own(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Build stimuli into a folder that no other test and no user has."""
    folder = tmp_path_factory.mktemp("cache")
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(folder))
    return folder
