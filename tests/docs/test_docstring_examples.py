"""Every example in a docstring runs, and prints what it says."""

from __future__ import annotations

import doctest
import importlib
import re
from functools import cache
from pathlib import Path

import pytest

pytestmark = pytest.mark.nightly

ROOT = Path(__file__).parents[2]
PACKAGES = ("documents", "devices", "stimuli", "analysis", "runner", "extensions", "cyclopean")
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


@cache
def _modules_with_examples() -> list[str]:
    """Return the modules in which a line begins as an example does; each worker asks, before its first test."""
    files = [file for package in PACKAGES for file in sorted((ROOT / package).rglob("*.py"))]
    begun = [file for file in files if re.search(r"^\s*>>> ", file.read_text(encoding="utf-8"), re.MULTILINE)]
    return [".".join(file.relative_to(ROOT).with_suffix("").parts) for file in begun]


@pytest.fixture(scope="module")
def cache_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One cache of stimuli for all examples: many simulate the same shipped experiment."""
    return tmp_path_factory.mktemp("cache")


@pytest.mark.parametrize("module", _modules_with_examples())
def test_examples_run(module: str, monkeypatch: pytest.MonkeyPatch, cache_folder: Path) -> None:
    monkeypatch.chdir(ROOT)
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(cache_folder))
    done = doctest.testmod(importlib.import_module(module), optionflags=FLAGS)
    assert done.attempted
    assert not done.failed


def test_the_packages_a_person_calls_have_examples() -> None:
    assert {"cyclopean.scaling", "cyclopean.pictures", "cyclopean.sessions"} <= set(_modules_with_examples())
