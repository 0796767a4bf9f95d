"""What tests of sessions share."""

from __future__ import annotations

import importlib.metadata
import shutil
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from runner.session import simulate
from tests.conftest import write_study


@pytest.fixture(scope="module")
def packages() -> Iterator[None]:
    """Read once what is installed, which each seal lists."""
    held = [SimpleNamespace(name=one.name, version=one.version) for one in importlib.metadata.distributions()]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(importlib.metadata, "distributions", lambda: held)
        yield


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Sessions of two simulated observers of the small study, made once."""
    folder = tmp_path_factory.mktemp("recorded")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CYCLOPEAN_CACHE", str(folder / "cache"))
        study = write_study(folder)
        simulate(study.experiment, study.observers, 2, results=study.results)
    return study.results


@pytest.fixture
def results(recorded: Path, tmp_path: Path, packages: None) -> Path:
    """A copy of them."""
    return Path(shutil.copytree(recorded, tmp_path / "results"))
