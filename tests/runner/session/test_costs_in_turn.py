"""Costs that come in turn: computed once, from the picture that was read, and never while a scene is timed."""

from __future__ import annotations

import errno
import json
import math
import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from runner import Scene
from runner.session.clipping_costs import CostCache
from runner.session.clocks import Pace, PacedPresenter
from runner.session.costs_in_turn import CostsInTurn
from runner.session.picture_source import PictureSource
from stimuli.errors import StimulusError
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


# Each picture of a session is read once while it is kept, counted, and handed to whoever computes its costs.


class Stimuli:
    """Pictures of one grey each; ``bad`` cannot be read."""

    def load(self, name: str, part: object) -> StereoImage:
        if name == "bad":
            raise StimulusError("bad")
        return StereoImage.flat(np.full((2, 3, 3), len(name), np.float32))


def source() -> PictureSource:
    return PictureSource(cast(Any, SimpleNamespace(visible_part=None)), cast(Any, Stimuli()))


def test_each_picture_is_read_once_and_handed_on_whenever_it_is_loaded() -> None:
    pictures = source()
    handed: list[tuple[str, StereoImage]] = []
    pictures.on_read = lambda name, image: handed.append((name, image))
    first, second = pictures.load("a"), pictures.load("bb")
    assert pictures.load("a") is first
    assert pictures.stimulus("bb") is second
    assert second.left[0, 0, 0] == 2
    assert pictures.read == 2
    assert handed == [("a", first), ("bb", second), ("a", first)]


def test_a_picture_that_a_block_makes_is_no_stimulus() -> None:
    pictures = source()
    made = StereoImage.flat(np.zeros((2, 3, 3), np.float32))
    pictures.add([cast(Any, SimpleNamespace(pictures={"disc": lambda: made}))])
    pictures.on_read = lambda name, image: pytest.fail(f"{name} was handed on")
    assert pictures.load("disc") is made
    assert pictures.read == 0


def test_a_picture_that_cannot_be_read_is_refused_where_it_is_asked_for() -> None:
    with pytest.raises(StimulusError, match="bad"):
        source().load("bad")


# A cached cost is read as it was computed, or not at all, and writing it never stops a session.


DEPENDS = {"version": 1, "picture": "ab" * 32, "places_px": ((0, -60), (0, 60)), "lift_share": 0.1}
COST = {"flat": False, "clipping": {"left": {"percent_any": 0.1234, "delta_e_00_mean": 1e-5}}}


def _only(folder: Path) -> Path:
    (file,) = folder.iterdir()
    return file


def test_what_was_kept_is_found_by_all_that_it_depends_on(tmp_path: Path) -> None:
    folder = tmp_path / "deep" / "costs"
    assert CostCache(folder).find(DEPENDS) is None
    assert CostCache(folder).keep(DEPENDS, COST)
    assert CostCache(folder).find(DEPENDS) == COST
    assert CostCache(folder).find({**DEPENDS, "places_px": [[0, -60], [0, 60]]}) == COST  # as JSON has it
    for other in ({"version": 2}, {"lift_share": math.nextafter(0.1, 1.0)}, {"places_px": ((0, -60),)}, {"more": None}):
        assert CostCache(folder).find({**DEPENDS, **other}) is None


def _as(data: object) -> Callable[[str], str]:
    return lambda text: json.dumps(data)


@pytest.mark.parametrize(
    "damage",
    [
        lambda text: "",
        lambda text: text[: len(text) // 2],
        lambda text: text.replace("0.1234", "0.1235"),
        lambda text: text.replace('"lift_share": 0.1', '"lift_share": 0.2'),
        lambda text: text.replace('"sha256"', '"sha265"'),
        lambda text: text.replace("false", "NaN"),
        lambda text: "[" * 100_000,
        lambda text: "\0" * len(text),
        _as([]),
        _as(None),
        _as({"depends_on": None, "cost": None, "sha256": None}),
    ],
)
def test_a_damaged_file_is_as_good_as_none_and_is_written_again(tmp_path: Path, damage: Callable[[str], str]) -> None:
    cache = CostCache(tmp_path)
    cache.keep(DEPENDS, COST)
    file = _only(tmp_path)
    text = file.read_text()
    assert damage(text) != text
    file.write_text(damage(text))
    assert cache.find(DEPENDS) is None
    assert cache.keep(DEPENDS, COST)
    assert cache.find(DEPENDS) == COST


def test_a_file_that_is_no_text_or_no_file_is_as_good_as_none(tmp_path: Path) -> None:
    cache = CostCache(tmp_path)
    cache.keep(DEPENDS, COST)
    file = _only(tmp_path)
    file.write_bytes(b"\xff\xfe")
    assert cache.find(DEPENDS) is None
    file.unlink()
    file.mkdir()
    assert cache.find(DEPENDS) is None
    assert not cache.keep(DEPENDS, COST)
    assert _only(tmp_path) == file


@pytest.mark.parametrize("refused", ["os.replace", "Path.write_bytes"])
def test_a_full_disk_is_not_in_the_way_and_nothing_is_left_of_the_attempt(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, refused: str
) -> None:
    def fail(path: Path, *_: object) -> None:
        if refused == "Path.write_bytes":
            path.touch()  # the disk took the name, and nothing of the content
        raise OSError(errno.ENOSPC, "No space left on device")

    owner, _, name = refused.partition(".")
    monkeypatch.setattr({"os": os, "Path": Path}[owner], name, fail)
    assert not CostCache(tmp_path).keep(DEPENDS, COST)
    assert not list(tmp_path.iterdir())


def test_what_a_killed_program_left_is_removed_and_what_another_is_writing_is_not(tmp_path: Path) -> None:
    left, writing = tmp_path / ".ab-x.part", tmp_path / ".ab-y.part"
    for part in (left, writing):
        part.write_text('{"depends')
    os.utime(left, (0, 0))
    cache = CostCache(tmp_path)
    assert cache.find(DEPENDS) is None
    assert cache.keep(DEPENDS, COST)
    assert not left.exists()
    assert writing.exists()
