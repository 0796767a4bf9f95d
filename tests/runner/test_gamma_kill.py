"""A person's session that loads the identity, killed in the middle: the next start restores the table and says so."""

from __future__ import annotations

import shutil
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from devices.display import GammaTable
from runner.presenter import monitors
from runner.presenter.surfaces.identity_tables import tables_folder
from tests.conftest import Person
from tests.forked import Server

Study = Any  # tests/conftest.py
pytestmark = pytest.mark.window


@pytest.fixture
def person(
    study: Study,
    gamma_server: str,
    load_table: Callable[[float], None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    forked: Server,
) -> Iterator[Person]:
    if shutil.which("xdotool") is None:
        pytest.skip("xdotool is not installed (package xdotool)")
    monkeypatch.setenv("CYCLOPEAN_STATE", str(tmp_path / "state"))
    study.edit("rig.yaml", "distance_mm: 700\n", "distance_mm: 700\ngamma_table: identity\n")
    someone = Person(gamma_server, study, forked)
    yield someone
    if someone.process is not None and someone.process.poll() is None:
        someone.process.kill()
        someone.process.communicate()


def table() -> GammaTable:
    (monitor,) = monitors()
    return monitor.gamma_table


def is_restored() -> bool:
    return table().same_as(GammaTable.from_shares(np.linspace(0, 1, 256) ** 1.1)) is True


def kept() -> list[Path]:
    return sorted(tables_folder().glob("*.json"))


def test_a_killed_session_is_resumed_with_the_identity_and_leaves_the_table_as_it_was(person: Person) -> None:
    person.sit_down()
    person.turn("space", "the first pair")
    person.answer("Up")
    assert person.process is not None
    person.process.send_signal(signal.SIGKILL)
    person.process.communicate()
    assert table().is_identity
    assert len(kept()) == 1
    person.sit_down("--resume")
    assert table().is_identity
    assert len(kept()) == 1
    person.turn("Escape")
    person.press("s")
    told = person.leave()
    assert "that was killed left the identity" in told
    assert "1 of 6 answers saved." in told
    assert is_restored()
    assert kept() == []
