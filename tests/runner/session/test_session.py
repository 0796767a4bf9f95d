"""The engine with simple fakes: one answer, one record, one scene at a time; resumed exactly."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from analysis.kinds import Trial
from analysis.records import SessionLog
from runner import Scene
from runner.blocks import Block
from runner.blocks.message import pause_menu
from runner.errors import SessionError
from runner.observers import BradleyTerryObserver, Person
from runner.ports import Ask, Holding, KeyPress, ObserverLeft
from runner.session import Event, Recorded, Resumed, Session
from runner.views import FULL_HD_HALF
from tests.runner.every_kind import HEADER, OnTrial, Stage, met, setting

NAMES = ("a", "b", "c", "d", "e")
PLACE = setting(NAMES)
LOOK = met("instructions", PLACE, text="Look.")


def _blocks(break_every: int | None = None, observer: str = "01") -> tuple[Block, ...]:
    pairs = met("all_pairs", setting(NAMES, observer), break_every=break_every)
    return (LOOK, pairs, met("break", PLACE, text="Rest."))


class Screen(Stage):
    """Shows a scene every ``pace_s``, with frames of half a second."""

    pace_s = 1.0

    def show(self, scene: Scene) -> float:
        return self.pace_s * super().show(scene)

    def hold(self, scene: Scene, seconds: float) -> Holding:
        return Holding(self.show(scene), round(seconds * 2), 0.5)


class Paper(Stage):
    """Keeps trials, and can break before one is kept."""

    before_append: Callable[[], None] = staticmethod(lambda: None)

    def hear(self, event: Event) -> None:
        if isinstance(event, Recorded) and isinstance(event.record, Trial):
            self.before_append()
        super().hear(event)


def _simulated(seed: int = 1) -> BradleyTerryObserver:
    return BradleyTerryObserver({name: 1.0 + index for index, name in enumerate(NAMES)}, random.Random(seed))


def test_every_answer_is_recorded_before_the_next_scene() -> None:
    screen, paper = Screen(), Paper()
    shown_at_append: list[int] = []
    paper.before_append = lambda: shown_at_append.append(len(screen.shown))
    Session(_blocks(), screen, _simulated(), paper).run()
    assert paper.ends
    assert len(paper.trials) == 1 + 10 + 1
    assert shown_at_append == list(range(1, 13))


def test_the_next_pair_is_prefetched() -> None:
    screen = Screen()
    Session(_blocks(break_every=4), screen, _simulated(), Paper()).run()
    pairs_shown = [scene for scene in screen.shown if scene.stimuli]
    assert list(dict.fromkeys(screen.prefetched)) == pairs_shown[1:]


def test_a_log_of_another_order_is_refused() -> None:
    paper = Paper()
    Session(_blocks(observer="01"), Screen(), _simulated(), paper).run()
    with pytest.raises(SessionError, match="not the one the experiment now asks"):
        Session(_blocks(observer="02"), Screen(), _simulated(), Paper(), Resumed(paper.trials)).run()


def test_a_log_longer_than_the_experiment_is_refused() -> None:
    paper = Paper()
    Session(_blocks(), Screen(), _simulated(), paper).run()
    with pytest.raises(SessionError, match="1 more trials"):
        Session(_blocks()[:2], Screen(), _simulated(), Paper(), Resumed(paper.trials)).run()


@dataclass
class Script:
    """A person who presses what is written; each press a second after the last scene."""

    keys: list[str]
    screen: Screen

    def wait_key(self) -> KeyPress:
        return KeyPress(self.keys.pop(0), len(self.screen.shown) + 0.5)


def _person(keys: list[str]) -> tuple[Person, Screen]:
    screen = Screen()
    return Person(Script(keys, screen).wait_key), screen


def test_escape_pauses_and_shows_the_pair_again() -> None:
    keys = ["space", "up", "escape", "c", "down", "escape", "x", "s"]
    observer, screen = _person(keys)
    paper = Paper()
    with pytest.raises(ObserverLeft):
        Session(_blocks(), screen, observer, paper).run()
    assert [trial.details().get("answer") for trial in paper.trials] == [None, "first", "second"]
    assert not paper.ends
    menu = pause_menu(FULL_HD_HALF, can_repeat=True).scene
    assert screen.shown.count(menu) == 2
    asked_again = screen.shown.index(menu) + 1
    assert screen.shown[asked_again] == screen.shown[asked_again - 2]


@pytest.mark.promise("press")
def test_keys_that_mean_nothing_and_keys_before_the_onset_are_no_answers() -> None:
    presses = [KeyPress("up", 0.9), KeyPress("q", 1.1), KeyPress("down", 1.2)]
    person = Person(lambda: presses.pop(0))
    ask = Ask(Scene(), {"up": "first", "down": "second"})
    assert person.respond(ask, 1.0) == KeyPress("down", 1.2)


@pytest.mark.parametrize("pace_s", [1.0, 1.25])
def test_timed_scenes_are_recorded_with_the_frames_that_were_missed(pace_s: float) -> None:
    """The screen shows a scene every ``pace_s``, with frames of half a second."""
    screen, paper = Screen(), Paper()
    screen.pace_s = pace_s
    block = met("all_pairs", setting("abc"), fixation_s=1.0, exposure_s=0.5, blank_s=2.0)
    Session((block,), screen, _simulated(), paper).run()
    first, second, _third = (trial.details()["timed"] for trial in paper.trials)
    assert [(held["what"], held["frames"], held["missed_frames"]) for held in first] == [
        ("fixation", 2, 0),
        ("pair", 1, 1),
    ]
    assert [held["what"] for held in second] == ["blank", "fixation", "pair"]
    assert second[0] == {
        "what": "blank",
        "frames": 4,
        "asked_ms": 2000.0,
        "shown_ms": 1000 * pace_s,
        "missed_frames": 0,
    }
    # After the exposure the question stands alone.
    assert [bool(scene.stimuli) for scene in screen.shown[:3]] == [False, True, False]
    assert len(screen.shown[2].items) == 1


def test_a_timed_session_resumes_without_showing_what_was_answered() -> None:
    def block() -> Block:
        return met("all_pairs", PLACE, fixation_s=1.0, exposure_s=0.5)

    whole = Paper()
    Session((block(),), Screen(), _simulated(), whole).run()
    screen, rest = Screen(), Paper()
    Session((block(),), screen, _simulated(), rest, Resumed(whole.trials[:7])).run()
    assert len(rest.trials) == 3
    assert len(screen.shown) == 3 * 3


def test_the_last_trial_can_be_repeated_and_the_last_attempt_counts() -> None:
    keys = ["space", "up", "up", "escape", "r", "down", "up", *["up"] * 7, "space"]
    observer, screen = _person(keys)
    paper = Paper()
    Session(_blocks(), screen, observer, paper).run()
    assert paper.ends
    pairs = [trial for trial in paper.trials if trial.kind == "all_pairs"]
    assert [(trial.trial, trial.attempt) for trial in pairs] == [
        (0, 0),
        (1, 0),
        (1, 1),
        *((n, 0) for n in range(2, 10)),
    ]
    again = pairs[2]
    assert (again.details()["first"], again.details()["second"]) == (
        pairs[1].details()["first"],
        pairs[1].details()["second"],
    )
    assert [pairs[1].details()["answer"], again.details()["answer"]] == ["first", "second"]
    assert [(mark.block, mark.trial, mark.by) for mark in paper.marks] == [(1, 1, "observer")]
    # The pair that was interrupted says so.
    assert [trial.details().get("interruptions") for trial in pairs[1:4]] == [None, None, 1]


def test_a_trial_marked_by_the_experimenter_comes_again_after_its_block() -> None:
    paper = Paper()

    def mark(trial: Trial) -> None:
        if trial.place == (1, 4) and trial.attempt == 0:
            assert session.mark("experimenter") == (1, 4)
            assert session.mark("experimenter") is None

    session = Session(_blocks(), Screen(), _simulated(), paper, listeners=[OnTrial(mark)])
    session.run()
    places = [(trial.place, trial.attempt) for trial in paper.trials]
    assert places[-2:] == [((1, 4), 1), ((2, 0), 0)]
    assert len(paper.trials) == 1 + 10 + 1 + 1


@pytest.mark.parametrize("answered", range(15))
def test_a_session_with_repeats_resumes_exactly(answered: int) -> None:
    """Wherever it stops, first attempts come in the same order, and a marked trial comes again just once."""

    class _Gone(Exception):
        pass

    paper = Paper()

    def mark(session: Session, trial: Trial) -> None:
        if trial.place in ((1, 2), (1, 7)) and trial.attempt == 0 and trial.place not in {m[:2] for m in marked()}:
            session.mark("experimenter")

    def marked() -> list[tuple[int, int]]:
        return [(m.block, m.trial) for m in paper.marks]

    def stop() -> None:
        if len(paper.trials) == answered:
            raise _Gone

    def session(before: Resumed) -> Session:
        made = Session(_blocks(break_every=3), Screen(), _simulated(), paper, before)
        made.listeners.append(OnTrial(lambda trial: mark(made, trial)))
        return made

    paper.before_append = stop
    try:
        session(Resumed()).run()
    except _Gone:
        paper.before_append = lambda: None
        log = SessionLog(Path(), HEADER, (*paper.trials, *paper.marks), False)
        session(Resumed.of(log)).run()
    assert paper.ends
    again = [trial.place for trial in paper.trials if trial.attempt]
    assert sorted(again) == [(1, 2), (1, 7)]
    first = [trial.place for trial in paper.trials if not trial.attempt]
    assert first == [(0, 0), *((1, n) for n in range(10)), (2, 0)]
    log = SessionLog(Path(), HEADER, (*paper.trials, *paper.marks), True)
    assert log.pending == ()
    assert [trial.attempt for trial in log.trials if trial.place in ((1, 2), (1, 7))] == [1, 1]


def test_a_note_is_typed_in_the_pause_and_kept_with_its_place() -> None:
    keys = ["space", "up", "escape", "n", *(f"text {c}" for c in "too  brighx"), "backspace", "text t", "enter", "c"]
    observer, screen = _person([*keys, *["up"] * 9, "space"])
    paper = Paper()
    Session(_blocks(), screen, observer, paper).run()
    (note,) = paper.notes
    assert (note.text, note.by, note.block, note.trial) == ("too  bright", "observer", 1, 1)
    assert len(paper.trials) == 12


def test_escape_gives_a_note_up() -> None:
    observer, screen = _person(["space", "escape", "n", "text a", "escape", "c", *["up"] * 10, "space"])
    paper = Paper()
    Session(_blocks(), screen, observer, paper).run()
    assert not paper.notes
    assert len(paper.trials) == 12


def test_a_trial_marked_after_its_block_is_asked_again_at_the_end() -> None:
    observer, screen = _person(["space", *["up"] * 10, "space", "down"])
    paper = Paper()
    session = Session(_blocks(), screen, observer, paper)
    session.listeners.append(OnTrial(lambda trial: None if trial.kind != "break" else _mark(session)))
    session.run()
    assert [(trial.place, trial.attempt) for trial in paper.trials[-2:]] == [((2, 0), 0), ((1, 9), 1)]
    assert paper.trials[-1].details()["answer"] == "second"
    assert paper.ends


def _mark(session: Session) -> None:
    assert session.mark("experimenter") == (1, 9)


@dataclass
class Still(Screen):
    """A presenter that does not draw a scene again which it shows, and whose clock is the person's."""

    now_s: float = 100.0
    onset_s: float = 0.0

    def show(self, scene: Scene) -> float:
        if not self.shown or scene != self.shown[-1]:
            self.onset_s = self.now_s
        self.shown.append(scene)
        return self.onset_s


def test_a_question_that_looks_like_the_last_one_is_timed_from_the_last_answer() -> None:
    screen, paper = Still(), Paper()
    waits_s = iter([1.5, 0.75, 2.0])

    def press() -> KeyPress:
        screen.now_s += next(waits_s)
        return KeyPress("space", screen.now_s)

    person = Person(press, clock=lambda: screen.now_s)
    Session([LOOK] * 3, screen, person, paper).run()
    assert all(scene == screen.shown[0] for scene in screen.shown)
    assert [trial.response_time_s for trial in paper.trials] == [1.5, 0.75, 2.0]
    assert [trial.events for trial in paper.trials] == [[("space", time_s)] for time_s in (1.5, 0.75, 2.0)]
