"""A recorded session played back: pixel by pixel the same screens, and the same answers at the same times."""

from __future__ import annotations

import hashlib
import random
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest

from analysis.kinds import Trial
from analysis.records import SessionLog, new_header, read_session
from runner import Scene
from runner.errors import SessionError
from runner.observers import BradleyTerryObserver
from runner.observers.presses import Replay, asked_after_their_block, check_replayable, read_recording
from runner.ports import Ask, Compare, KeyPress, Observer, WindowClosed
from runner.protocol import read_experiment
from runner.session import Recorder, Resumed, Session, SessionOptions
from runner.session.station import Station
from stimuli.build import build_set
from tests.answers import altered, changed
from tests.runner.every_kind import OnTrial, Stage, met, setting

Study = Any  # tests/conftest.py
SCORES = {"one": 1.0, "two": 2.0, "three": 3.0, "four": 4.0}
REPEAT, NOTE = ("escape", "r"), ("escape", "n", "text h", "text i", "enter", "c")


@dataclass
class Fidgety:
    """Someone who answers, but before some comparisons does something else first."""

    before: dict[int, tuple[str, ...]]
    observer: Observer = field(default_factory=lambda: BradleyTerryObserver(SCORES, random.Random(1)))
    compared: int = 0
    doing: deque[str] = field(default_factory=deque)

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        if isinstance(ask.task, Compare) and not self.doing:
            self.doing += self.before.pop(self.compared, ())
            self.compared += not self.doing
        return KeyPress(self.doing.popleft(), onset_s + 0.123) if self.doing else self.observer.respond(ask, onset_s)


class Watched:
    """A presenter of whose screens a digest is kept, each time that one is shown."""

    def __init__(self, presenter: Any) -> None:
        self._presenter = presenter
        self.digests: list[str] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(self._presenter, name)

    def show(self, scene: Scene) -> float:
        onset_s: float = self._presenter.show(scene)
        codes = b"".join(picture.tobytes() for picture in self._presenter.capture().values())
        self.digests.append(hashlib.sha256(codes).hexdigest())
        return onset_s


def _station(study: Study, results: Path, do: Callable[[Station], Path]) -> tuple[SessionLog, list[str]]:
    design = read_experiment(study.experiment)
    stimuli = build_set(design.recipe_file, design.rig.display.panel.pixel_pitch_mm)
    with Station.open(design, stimuli, SessionOptions(results, backend="egl")) as station:
        watched = Watched(station.presenter)
        station.presenter = watched  # type: ignore[assignment]  # stands in for the real one
        folder = do(station)
    return read_session(folder / "session.jsonl"), watched.digests


def _answers(log: SessionLog) -> list[tuple[Any, ...]]:
    return [(t.block, t.trial, t.attempt, t.kind, t.events, t.response_time_s, _lasting(t)) for t in log.answers]


def _lasting(trial: Trial) -> dict[str, Any]:
    return {key: value for key, value in trial.details().items() if key != "timed"}


@pytest.mark.promise("one-engine")
@pytest.mark.parametrize("before", [{}, {2: NOTE, 5: REPEAT}], ids=["plain", "note"])
def test_a_replay_shows_the_same_pixels_and_gives_the_same_answers(
    study: Study, tmp_path: Path, before: dict[int, tuple[str, ...]]
) -> None:
    study.edit("small.yaml", "break_every: 4", "break_every: 4, fixation_s: 0.1, blank_s: 0.1")
    person = Fidgety(dict(before))
    log, screens = _station(study, study.results, lambda s: s.run("01", person, simulated=True))
    again, screens_again = _station(study, tmp_path / "again", lambda s: s.replay(log, "01"))
    assert again.complete
    if NOTE in before.values():  # what was typed into the pause is in the log, but is no part of what it meant
        assert [note.text for note in log.notes] == ["hi"]
        assert [digest for digest in screens_again if digest not in screens] == []
        assert [t[:-1] for t in _answers(again)] == [t[:-1] for t in _answers(log)]
    else:
        assert screens_again == screens
        assert _answers(again) == _answers(log)
    assert len(set(screens)) > 6
    assert any(trial.attempt for trial in log.answers) == (REPEAT in before.values())
    assert again.header.simulated
    assert f"a replay of session {log.header.session}" in again.header.remarks


def test_screens_of_another_session_are_others(study: Study, tmp_path: Path) -> None:
    """The digests would tell: another observer meets the same pairs in another order."""
    _, screens = _station(study, study.results, lambda s: s.run("01", Fidgety({}), simulated=True))
    _, others = _station(study, tmp_path / "again", lambda s: s.run("02", Fidgety({}), simulated=True))
    assert screens != others


STIMULI = tuple({"name": name} for name in SCORES)
HEADER = new_header(
    "e", "01", "s", "2026-01-01T00:00:00+00:00", question="Which?", simulated=True, stimuli=STIMULI, hashes={"a": "1"}
)
PLACE = setting(SCORES)
BLOCKS = (
    met("instructions", PLACE, text="Look."),
    met("all_pairs", PLACE, repeats=2, break_every=5),
    met("break", PLACE, text="Rest."),
)


def _recorded(folder: Path, observer: Observer, marks: Any = (), pending: Any = ()) -> tuple[SessionLog, Stage]:
    """Record a session in which the experimenter marks some trials of the pairs."""
    screen = Stage()
    with Recorder.create(folder, altered(HEADER)) as recorder:
        session = Session(BLOCKS, screen, observer, recorder, Resumed(pending=pending))

        def mark(trial: Trial) -> None:
            if trial.block == 1 and trial.trial in marks and not trial.attempt:
                session.mark("experimenter")

        session.listeners.append(OnTrial(mark))
        with suppress(WindowClosed):
            session.run()
    return read_session(folder / "session.jsonl"), screen


@pytest.mark.parametrize("marks", [(), (4, 9), (11,)])
@pytest.mark.parametrize("before", [{}, {7: REPEAT, 9: REPEAT}])
def test_trials_asked_again_come_again_where_they_came(
    tmp_path: Path, marks: tuple[int, ...], before: dict[int, tuple[str, ...]]
) -> None:
    log, screen = _recorded(tmp_path / "one", Fidgety(dict(before)), marks)
    assert sum(answer.attempt > 0 for answer in log.answers) == len(marks) + len(before)
    pending = asked_after_their_block(log)
    assert pending == tuple((1, trial) for trial in marks)
    again, screen_again = _recorded(tmp_path / "two", Replay.of(log), (), pending)
    assert _answers(again) == _answers(log)
    assert screen_again.shown == screen.shown


def test_a_session_that_stopped_is_replayed_as_far_as_it_went(tmp_path: Path) -> None:
    log, _ = _recorded(tmp_path / "one", Fidgety({}))
    stopped = replace(log, records=log.answers[:6], complete=False)
    again, _ = _recorded(tmp_path / "two", Replay.of(stopped))
    assert _answers(again) == _answers(stopped)
    assert not again.complete


def test_a_log_of_other_keys_is_refused(tmp_path: Path) -> None:
    log, _ = _recorded(tmp_path / "one", Fidgety({}))
    bent = changed(log.answers[1], events=(("q", 0.5),))
    with pytest.raises(SessionError, match="the key 'q' where only"):
        _recorded(tmp_path / "two", Replay.of(replace(log, records=(log.answers[0], bent))))


def test_what_is_not_that_session_is_refused(tmp_path: Path) -> None:
    log, _ = _recorded(tmp_path / "one", Fidgety({}))
    assert check_replayable(log, "e", "01", {"a": "1"}) == ("a replay of session s",)
    with pytest.raises(SessionError, match="is of 'e' and observer 01"):
        check_replayable(log, "e", "02", {"a": "1"})
    with pytest.raises(SessionError, match="is of 'e' and observer 01"):
        check_replayable(log, "f", "01", {"a": "1"})
    with pytest.raises(SessionError, match="the a changed since the recorded session"):
        check_replayable(log, "e", "01", {"a": "2"})
    (remark,) = check_replayable(log, "e", "01", {"a": "2"}, accept_changes=True)
    assert remark.endswith("although the a changed")
    _recorded(tmp_path / "two", Fidgety({}))
    with pytest.raises(SessionError, match="there are 2 sessions here"):
        read_recording(tmp_path)
    assert read_recording(tmp_path / "one").answers == log.answers
