"""The copies of the files that a session was made with vanish, shrink or are changed while it runs."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from analysis.kinds import Trial
from analysis.records import read_session
from runner.session import Recorder
from tests.runner.harms import TO_FILE, Harm

Study = Any  # tests/conftest.py


def _listed(place: Path) -> Path:
    return place / "configuration.json"


def _rig(place: Path) -> Path:
    return place / "rig.yaml"


# Of the copies of the files that a session was made with, in their folder.
TO_CONFIGURATION: dict[str, Harm] = {
    "the list vanishes": lambda place: _listed(place).unlink(),
    "the list shrinks": lambda place: TO_FILE["cut off"](_listed(place)),
    "the list is replaced": lambda place: TO_FILE["replaced"](_listed(place)),
    "a file vanishes": lambda place: _rig(place).unlink(),
    "a file shrinks": lambda place: TO_FILE["cut off"](_rig(place)),
    "a file is replaced": lambda place: TO_FILE["replaced"](_rig(place)),
    "a file is edited": lambda place: TO_FILE["edited"](_rig(place)),
    "the folder vanishes": shutil.rmtree,
}


@pytest.mark.parametrize("phase", [7, pytest.param("between", marks=pytest.mark.nightly)])
def test_what_a_session_was_made_with_is_whole_at_its_end(study: Study, phase: int | str) -> None:
    """Whatever was done to it while the session ran, or before the next one of the experiment."""
    for harm, done in TO_CONFIGURATION.items():
        shutil.rmtree(study.results, ignore_errors=True)
        told = _run_harmed(study, phase, done)
        assert told.returncode == 0, told.stderr
        (place,) = (study.results / "small" / "configuration").iterdir()
        listed = json.loads(_listed(place).read_text(encoding="utf-8"))
        for name, digest in listed["files"].items():
            assert hashlib.sha256((place / name).read_bytes()).hexdigest() == digest, (harm, name)
        said = phase != "between" and "replaced" not in harm
        assert ("removed or changed" in told.stderr) is said, (harm, told.stderr)
        assert not said or str(place) in told.stderr


def test_where_it_cannot_be_written_again_the_session_says_so(study: Study) -> None:
    def harm(place: Path) -> None:
        shutil.rmtree(place.parent)
        place.parent.write_text("a file where the folder should be")

    for phase in (1, 7):
        shutil.rmtree(study.results, ignore_errors=True)
        told = _run_harmed(study, phase, harm)
        assert told.returncode == 1
        assert "the session's configuration cannot be written" in told.stderr
        assert "Every answer is saved" in told.stderr
        log = study.log_file()
        assert read_session(log).complete
        assert str(log) in told.stderr


def _run_harmed(study: Study, phase: int | str, harm: Harm) -> Any:
    """Run a session, and ``harm`` the folder of its configuration after an answer, or ``between`` it and another."""
    kept: list[Trial] = []
    append = Recorder.append

    def then_harm(self: Recorder, record: Any) -> None:
        append(self, record)
        kept.extend([record] if isinstance(record, Trial) else [])
        if isinstance(record, Trial) and len(kept) == phase:
            harm(next((study.results / "small" / "configuration").iterdir()))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Recorder, "append", then_harm)
        told = study.run(expect=None)
        if phase == "between":
            harm(next((study.results / "small" / "configuration").iterdir()))
            told = study.run(observer="02", expect=None)
    return told
