"""What holds for every kind of block: replayed from anywhere, ended by its last record, right in what it says."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from runner.blocks import Browse, Rate
from runner.blocks.best_of_series import BestOfSeries
from runner.blocks.layout import SingleLayout
from runner.blocks.rating import Rating
from runner.blocks.scale import Scale
from runner.blocks.series import Series
from runner.blocks.tasks import GoOn
from runner.ports import Ask

Play = Callable[..., Any]  # conftest.py
LAYOUT = SingleLayout((0, -60), (400, 300), (0, -250), 800, 90)
BESIDE = SingleLayout((210, -60), (400, 300), (0, -250), 800, 90, (-210, -60))
SCALES = (Scale("quality", "How good?", 1, 5), Scale("depth", "How deep?", 0, 100))
SERIES = tuple(
    Series(f"{paint}-{kind}", (f"{paint}{kind}1", f"{paint}{kind}2"), paint) for paint in "ab" for kind in "xy"
)
RATING = Rating(("a", "b", "c"), SCALES, LAYOUT, "s", repeats=2)
BEST = BestOfSeries(SERIES, "Which?", LAYOUT, "s")
BLOCKS: dict[str, tuple[Rating | BestOfSeries, set[type]]] = {
    "rating": (RATING, {Rate}),
    "rating, timed": (replace(RATING, fixation_s=1.0, exposure_s=0.5, blank_s=2.0, break_every=2), {Rate, GoOn}),
    "rating beside a reference": (replace(RATING, stimuli=("a",), repeats=1, layout=BESIDE, reference="r"), {Rate}),
    "best of series": (BEST, {Browse, Rate}),
    "best of series, with breaks": (replace(BEST, break_every=1, wrap=True, start="first"), {Browse, Rate, GoOn}),
    "best of series without ratings": (replace(BEST, scales=(), see_all=False, layout=BESIDE, reference="r"), {Browse}),
}


@pytest.mark.parametrize("name", BLOCKS)
def test_it_is_the_same_again_and_resumes_from_anywhere(name: str, play: Play) -> None:
    block, _ = BLOCKS[name]
    whole, again = play(block), play(replace(block))
    assert again.shown == whole.shown
    assert again.trials == whole.trials
    assert len(whole.trials) == block.trials
    assert whole.shown_at_record[-1] == len(whole.shown)
    for answered in range(len(whole.trials) + 1):
        rest = play(block, logged=whole.trials[:answered])
        assert [_told(trial) for trial in rest.trials] == [_told(trial) for trial in whole.trials[answered:]]
        # What the log holds is not shown again.
        before = whole.shown_at_record[answered - 1] if answered else 0
        assert len(rest.shown) <= len(whole.shown) - before
        assert rest.shown == whole.shown[len(whole.shown) - len(rest.shown) :]


@pytest.mark.parametrize("name", BLOCKS)
def test_its_records_and_tasks_say_what_they_are(name: str, play: Play) -> None:
    block, tasks = BLOCKS[name]
    whole = play(block)
    kind = "rating" if isinstance(block, Rating) else "best_of_series"
    assert {trial.kind for trial in whole.trials} == {kind}
    for trial in whole.trials:
        assert json.loads(json.dumps(trial.data)) == trial.data
        pressed_s = sum(seconds for _, seconds in trial.events)
        assert 0 < trial.response_time_s <= pressed_s
    assert {type(ask.task) for ask in whole.asks} == tasks
    reference = block.reference
    for ask in whole.asks:
        assert isinstance(ask.task, GoOn) or ask.task.reference == reference
        assert isinstance(ask.task, GoOn) or bool(reference) == ("r" in ask.scene.stimuli)
        assert set(ask.keys) <= {*block.keys, "home", "end", "page_up", "page_down"}


@pytest.mark.parametrize("name", BLOCKS)
def test_everything_can_be_answered_with_the_mouse_alone(name: str, play: Play) -> None:
    def click(ask: Ask) -> str:
        task = ask.task
        if isinstance(task, Rate):
            return f"click {task.highest}" if task.current is None else "click accept"
        if isinstance(task, Browse):
            left = set(range(len(task.series))) - task.seen
            return "click choose" if not left else "click next" if max(left) > task.index else "click previous"
        return "click continue"

    clicked = play(BLOCKS[name][0], click)
    assert len(clicked.trials) == BLOCKS[name][0].trials
    assert all(key.startswith("click ") for trial in clicked.trials for key, _ in trial.events)


def _told(trial: Any) -> Any:
    """Return what a record says but for what hung on when it was made."""
    return trial.place, trial.kind, trial.events, trial.response_time_s, {**trial.data, "timed": None}
