"""The engine with simple fakes: one answer, one record, one scene at a time; resumed exactly."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import pytest

from analysis.records import Trial
from runner.blocks.all_pairs import AllPairs, PairLayout
from runner.blocks.message import Message
from runner.blocks.steps import Block
from runner.errors import SessionError
from runner.observers.keyboard import Keyboard
from runner.observers.simulated import BradleyTerryObserver
from runner.ports import Ask, Holding, KeyPress
from runner.presenter.scene import Scene
from runner.session import LEAVE, Left, Session

NAMES = ("a", "b", "c", "d", "e")
LAYOUT = PairLayout("vertical", (0, -60), (0, 60), (100, 80), (0, -140), 400)


def _blocks(break_every: int | None = None, seed: str = "o") -> tuple[Block, ...]:
    pairs = AllPairs(NAMES, "Which?", LAYOUT, "s", seed, break_every=break_every)
    return (Message("instructions", "Look."), pairs, Message("break", "Rest."))


@dataclass
class Screen:
    """A presenter that remembers what it was asked to show."""

    shown: list[Scene] = field(default_factory=list)
    prefetched: list[Scene] = field(default_factory=list)

    def show(self, scene: Scene) -> float:
        self.shown.append(scene)
        return float(len(self.shown))

    def prefetch(self, scene: Scene) -> None:
        self.prefetched.append(scene)

    def hold(self, scene: Scene, seconds: float) -> Holding:
        return Holding(self.show(scene), round(seconds * 2), 0.5)


@dataclass
class Paper:
    """A sink that keeps trials, and can break after some."""

    trials: list[Trial] = field(default_factory=list)
    ended: bool = False
    before_append: Callable[[], None] = lambda: None

    def append(self, trial: Trial) -> None:
        self.before_append()
        self.trials.append(trial)

    def end(self, facts: Mapping[str, Any]) -> None:
        self.ended = True


def _simulated(seed: int = 1) -> BradleyTerryObserver:
    return BradleyTerryObserver({name: 1.0 + index for index, name in enumerate(NAMES)}, random.Random(seed))


def _run(session: Session) -> None:
    session.run()


def test_every_answer_is_recorded_before_the_next_scene() -> None:
    screen, paper = Screen(), Paper()
    shown_at_append: list[int] = []
    paper.before_append = lambda: shown_at_append.append(len(screen.shown))
    _run(Session(_blocks(), screen, _simulated(), paper))
    assert paper.ended
    assert len(paper.trials) == 1 + 10 + 1
    assert shown_at_append == list(range(1, 13))


def test_records_say_what_was_shown_and_chosen() -> None:
    screen, paper = Screen(), Paper()
    _run(Session(_blocks(), screen, _simulated(), paper, clip_costs={name: {"of": name} for name in NAMES}))
    pairs = [trial for trial in paper.trials if trial.kind == "all_pairs"]
    for trial, scene in zip(pairs, screen.shown[1:], strict=False):
        assert (trial.data["first"], trial.data["second"]) == scene.stimuli
        up = trial.events[-1][0] == "up"
        assert trial.data["answer"] == ("first" if up else "second")
        assert trial.data["chosen"] == trial.data["first" if up else "second"]
        assert trial.data["rejected"] == trial.data["second" if up else "first"]
        assert trial.data["first_position"] == "top"
        assert set(trial.data["clipping"]) == set(scene.stimuli)
        assert trial.response_time_s == pytest.approx(trial.events[-1][1])
    assert [trial.trial for trial in pairs] == list(range(10))


def test_the_next_pair_is_prefetched() -> None:
    screen = Screen()
    _run(Session(_blocks(break_every=4), screen, _simulated(), Paper()))
    pairs_shown = [scene for scene in screen.shown if scene.stimuli]
    assert list(dict.fromkeys(screen.prefetched)) == pairs_shown[1:]


@pytest.mark.parametrize("answered", range(13))
def test_a_session_stopped_anywhere_resumes_exactly(answered: int) -> None:
    whole = Paper()
    _run(Session(_blocks(break_every=3), Screen(), _simulated(), whole))

    class _Gone(Exception):
        pass

    first_part, screen = Paper(), Screen()

    def stop() -> None:
        if len(first_part.trials) == answered:
            raise _Gone

    first_part.before_append = stop
    session = Session(_blocks(break_every=3), screen, _simulated(), first_part)
    if answered < 12:
        with pytest.raises(_Gone):
            session.run()
    else:
        session.run()
    rest, later = Paper(), Screen()
    resumed = Session(_blocks(break_every=3), later, _simulated(2), rest, logged=first_part.trials)
    resumed.run()
    asked = [(t.block, t.trial, t.kind, t.data.get("first"), t.data.get("second")) for t in whole.trials]
    done = first_part.trials + rest.trials
    assert [(t.block, t.trial, t.kind, t.data.get("first"), t.data.get("second")) for t in done] == asked
    # What the log holds is not shown again.
    breaks = 3
    assert len(later.shown) <= len(whole.trials) + breaks - answered
    assert rest.ended


def test_a_log_of_another_order_is_refused() -> None:
    paper = Paper()
    _run(Session(_blocks(seed="one"), Screen(), _simulated(), paper))
    with pytest.raises(SessionError, match="not the one the experiment now asks"):
        _run(Session(_blocks(seed="two"), Screen(), _simulated(), Paper(), logged=paper.trials))


def test_a_log_longer_than_the_experiment_is_refused() -> None:
    paper = Paper()
    _run(Session(_blocks(), Screen(), _simulated(), paper))
    with pytest.raises(SessionError, match="1 more trials"):
        _run(Session(_blocks()[:2], Screen(), _simulated(), Paper(), logged=paper.trials))


@dataclass
class Script:
    """A person who presses what is written; each press a second after the last scene."""

    keys: list[str]
    screen: Screen

    def wait_key(self) -> KeyPress:
        return KeyPress(self.keys.pop(0), len(self.screen.shown) + 0.5)


def _person(keys: list[str]) -> tuple[Keyboard, Screen]:
    screen = Screen()
    return Keyboard(Script(keys, screen).wait_key), screen


def test_escape_asks_before_leaving_and_shows_the_pair_again() -> None:
    keys = ["space", "up", "escape", "n", "down", "escape", "x", "y"]
    observer, screen = _person(keys)
    paper = Paper()
    with pytest.raises(Left):
        _run(Session(_blocks(), screen, observer, paper))
    assert [trial.data.get("answer") for trial in paper.trials] == [None, "first", "second"]
    assert not paper.ended
    assert screen.shown.count(LEAVE.scene) == 2
    asked_again = screen.shown.index(LEAVE.scene) + 1
    assert screen.shown[asked_again] == screen.shown[asked_again - 2]


def test_keys_that_mean_nothing_and_keys_before_the_onset_are_no_answers() -> None:
    presses = [KeyPress("up", 0.9), KeyPress("q", 1.1), KeyPress("down", 1.2)]
    keyboard = Keyboard(lambda: presses.pop(0))
    ask = Ask(Scene(), {"up": "first", "down": "second"})
    assert keyboard.respond(ask, 1.0) == KeyPress("down", 1.2)


def test_simulated_answers_follow_the_law() -> None:
    observer = BradleyTerryObserver({"a": 3.0, "b": 1.0}, random.Random(5))
    block = AllPairs(("a", "b"), "Which?", LAYOUT, "s", "o", repeats=4000)
    paper = Paper()
    _run(Session((block,), Screen(), observer, paper))
    share = sum(trial.data["chosen"] == "a" for trial in paper.trials) / 4000
    assert share == pytest.approx(0.75, abs=0.025)


def test_timed_scenes_are_recorded_with_the_frames_that_were_missed() -> None:
    """The screen of these tests shows a scene a second, with frames of half a second."""
    screen, paper = Screen(), Paper()
    block = AllPairs(("a", "b", "c"), "Which?", LAYOUT, "s", "o", fixation_s=1.0, exposure_s=0.5, blank_s=2.0)
    _run(Session((block,), screen, _simulated(), paper))
    first, second, _third = (trial.data["timed"] for trial in paper.trials)
    assert [(held["what"], held["frames"], held["missed_frames"]) for held in first] == [
        ("fixation", 2, 0),
        ("pair", 1, 1),
    ]
    assert [held["what"] for held in second] == ["blank", "fixation", "pair"]
    assert second[0] == {"what": "blank", "frames": 4, "asked_ms": 2000.0, "shown_ms": 1000.0, "missed_frames": 0}
    # After the exposure the question stands alone.
    assert [bool(scene.stimuli) for scene in screen.shown[:3]] == [False, True, False]
    assert len(screen.shown[2].items) == 1


def test_a_timed_session_resumes_without_showing_what_was_answered() -> None:
    def block() -> AllPairs:
        return AllPairs(NAMES, "Which?", LAYOUT, "s", "o", fixation_s=1.0, exposure_s=0.5)

    whole = Paper()
    _run(Session((block(),), Screen(), _simulated(), whole))
    screen, rest = Screen(), Paper()
    _run(Session((block(),), screen, _simulated(), rest, logged=whole.trials[:7]))
    assert len(rest.trials) == 3
    assert len(screen.shown) == 3 * 3
