"""What proves a listener, and one of another package in a session: it is asked for by name, and costs no answer."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from analysis.records import read_session, session_files
from cyclopean.testing import BrokenPromiseError, prove_listener
from documents import InputError
from runner.session import LISTENERS, SessionOptions, SessionStatus, run_session

LISTENER = """
import time
from pathlib import Path
from runner.session import Recorded, SceneShown, SessionBegan

CYCLOPEAN_INTERFACE = 1

class Lamp:
    def hear(self, event):
        if isinstance(event, Recorded):
            with Path("lamp.txt").open("a") as file:
                file.write("on\\n")
"""
BROKEN = {
    "isinstance(event, Recorded)": ("event.trial", "raises nothing"),
    "def hear(self, event):": ("def hear(self, event):\n        time.sleep(0.006)", "no time"),
    "if isinstance": (
        "if isinstance(event, SessionBegan):\n            self.session = event.session\n"
        "        if isinstance(event, SceneShown) and event.shown.trials == 2:\n            self.session.mark('lamp')\n"
        "        if isinstance",
        "no answer",
    ),
}


def _listener(old: str = "", new: str = "") -> Any:
    held: dict[str, Any] = {}
    exec(LISTENER.replace(old, new) if old else LISTENER, held)
    return held["Lamp"]


@pytest.mark.parametrize("old", BROKEN)
def test_a_broken_promise_is_found(old: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    new, said = BROKEN[old]
    with pytest.raises(BrokenPromiseError, match=said):
        prove_listener(_listener(old, new), tmp_path)


def test_ours_and_a_sound_one_keep_the_promises(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for number, listener in enumerate((SessionStatus, _listener())):
        (tmp_path / str(number)).mkdir()
        assert len(prove_listener(listener, tmp_path / str(number))) == 4


def test_one_of_another_package_hears_a_session_that_names_it(
    install: Callable[..., None], study: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(LISTENERS, "_loaded", {})
    monkeypatch.chdir(tmp_path)
    install("lamps", LISTENER, "2.1", group=LISTENERS.group, lamp="Lamp")
    install("torn", LISTENER.replace("with Path", "1 / 0\n            with Path"), group=LISTENERS.group, torn="Lamp")
    install("unmade", LISTENER.replace("hear", "__init__ = None\n    def hear"), group=LISTENERS.group, unmade="Lamp")
    for wrong in ("lmap", "unmade"):
        with pytest.raises(InputError, match="'lamp'" if wrong == "lmap" else "unmade 1.0"):
            run_session(
                study.experiment, "01", SessionOptions(study.results, simulate=study.observers, listen=(wrong,))
            )
    done = run_session(
        study.experiment, "01", SessionOptions(study.results, simulate=study.observers, listen=("torn", "lamp"))
    )
    assert done.completed
    log = read_session(next(session_files(study.results)))
    assert len((tmp_path / "lamp.txt").read_text().split()) >= len(log.trials)
    assert (
        json.loads(log.file.read_text().splitlines()[0])["software"].items() >= {"lamps": "2.1", "torn": "1.0"}.items()
    )
    assert [note.text for note in log.notes if "ZeroDivisionError" in note.text] == [log.notes[0].text]
