"""Costs that come in turn: computed once, from the picture that was read, and never while a scene is timed."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from runner import Scene
from runner.session.clocks import Pace, PacedPresenter
from runner.session.costs_in_turn import CostsInTurn
from stimuli.pictures import StereoImage

GREY = StereoImage.flat(np.ones((2, 3, 3), np.float32))
WAIT_S = 30.0


class Costs:
    """Costs of three pictures, of which the cache has those of ``a``; computing one waits for ``go``."""

    def __init__(self) -> None:
        self.stimuli = SimpleNamespace(names=("a", "b", "c"))
        self.computed: list[tuple[str, StereoImage | None]] = []
        self.go, self.began = threading.Event(), threading.Event()
        self.go.set()

    def outline(self, name: str) -> dict[str, Any]:
        return {"name": name, "flat": True, **({"clipping": {"of": "a"}} if name == "a" else {})}

    def description(self, name: str, image: StereoImage | None = None) -> dict[str, Any]:
        self.began.set()
        assert self.go.wait(WAIT_S)
        self.computed.append((name, image))
        return {"name": name, "flat": True, "clipping": {"of": name}}


@pytest.fixture
def costs() -> Costs:
    return Costs()


@pytest.fixture
def in_turn(costs: Costs) -> Iterator[CostsInTurn]:
    made = CostsInTurn(cast(Any, costs))
    yield made
    costs.go.set()
    made.end()


def test_a_cost_is_computed_when_it_is_first_asked_for(costs: Costs, in_turn: CostsInTurn) -> None:
    assert "b" in in_turn
    assert "d" not in in_turn
    assert list(in_turn) == ["a", "b", "c"]
    assert len(in_turn) == 3
    in_turn.was_read("b", GREY)  # nobody sits there: it is not computed before its time
    assert costs.computed == []
    assert ["clipping" in one for one in in_turn.stimuli] == [True, False, False]
    assert in_turn["a"] == {"of": "a"}
    assert in_turn["b"] == in_turn["b"] == {"of": "b"}
    assert costs.computed == [("b", None)]
    assert in_turn.of(["a", "b", "c"]) == {name: {"of": name} for name in "abc"}
    assert costs.computed == [("b", None), ("c", None)]


def test_a_picture_that_was_read_is_taken_as_it_is_and_once(costs: Costs, in_turn: CostsInTurn) -> None:
    done = threading.Semaphore(0)
    in_turn.begin(done.release)
    costs.go.clear()
    for name in ("a", "b", "b", "disc"):
        in_turn.was_read(name, GREY)
    assert in_turn.is_busy
    costs.go.set()
    assert done.acquire(timeout=WAIT_S)
    assert not in_turn.is_busy
    assert costs.computed == [("b", GREY)]
    assert in_turn["b"] == {"of": "b"}
    assert costs.computed == [("b", GREY)]


def test_nothing_is_computed_in_a_pause_but_what_is_asked_for(costs: Costs, in_turn: CostsInTurn) -> None:
    done = threading.Semaphore(0)
    in_turn.begin(done.release)
    in_turn.pause()
    in_turn.pause()
    in_turn.was_read("b", GREY)
    assert not costs.began.wait(0.05)
    assert in_turn["c"] == {"of": "c"}  # a trial's record does not wait for the end of the pause
    assert costs.computed == [("c", None)]
    in_turn.resume()
    in_turn.resume()
    assert done.acquire(timeout=WAIT_S)
    assert costs.computed == [("c", None), ("b", GREY)]


def test_a_pause_begins_once_what_is_under_way_is_done(costs: Costs, in_turn: CostsInTurn) -> None:
    in_turn.begin(lambda: None)
    costs.go.clear()
    in_turn.was_read("b", GREY)
    assert costs.began.wait(WAIT_S)
    threading.Timer(0.05, costs.go.set).start()
    in_turn.pause()
    assert costs.computed == [("b", GREY)]


def test_what_waits_at_the_end_is_computed_when_it_is_asked_for(costs: Costs, in_turn: CostsInTurn) -> None:
    in_turn.begin(lambda: None)
    in_turn.pause()
    in_turn.was_read("b", GREY)
    in_turn.was_read("c", GREY)
    in_turn.end()
    in_turn.was_read("c", GREY)
    assert not in_turn.is_busy
    assert in_turn["c"] == {"of": "c"}


def test_timed_scenes_are_shown_in_a_pause_and_questions_end_it() -> None:
    said: list[str] = []

    def show(scene: Scene) -> float:
        said.append("show")
        return 0.0

    presenter = SimpleNamespace(show=show, surface=SimpleNamespace(on_frame=None, poll_keys=lambda: ()))
    beside = (lambda: said.append("pause")), (lambda: said.append("resume"))
    paced = PacedPresenter(cast(Any, presenter), Pace(0.01, swaps_wait=False, instantly=True), *beside)
    paced.hold(Scene(), 0.1)
    paced.show(Scene())
    assert said == ["pause", "show", "show", "resume"]
