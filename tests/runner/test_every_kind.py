"""What must hold for every kind of block that an experiment file can have, whoever wrote it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from analysis.kinds import KINDS, PRACTICE, Trial
from analysis.records import PooledBatch, read_session
from documents import InputError
from runner.blocks import BLOCKS, Block
from runner.observers import plain_key
from runner.ports import Ask, KeyPress
from runner.session import Resumed, Session
from tests.runner import every_kind as EVERY
from tests.runner.every_kind import HEADER, VARIANTS, Stage
from tests.runner.families import by_first_way

MOST_ASKS = 5_000


WORDS = ("instructions", "break")


class Plain:
    """Who gives the plainest answers, each after a second."""

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        return KeyPress(plain_key(ask), onset_s + 1.0)


def _play(
    blocks: Sequence[Block], observer: Any, logged: Sequence[Trial] = (), batches: Sequence[PooledBatch] = ()
) -> Stage:
    play = Stage()

    class _Watched:
        def respond(self, ask: Ask, onset_s: float) -> KeyPress:
            play.asks.append(ask)
            assert len(play.asks) < MOST_ASKS, "the block asks without end"
            press: KeyPress = observer.respond(ask, onset_s)
            return press

    utc = "2026-01-01T00:00:00.000+00:00"
    Session(blocks, play, _Watched(), play, Resumed(logged, (), batches), utc=lambda: utc).run()
    assert play.ends
    return play


def _told(trial: Trial) -> Any:
    """Return what a record says, but for how long scenes stood."""
    data = {key: value for key, value in trial.details().items() if key != "timed"}
    return trial.place, trial.kind, trial.events, trial.response_time_s, data


def test_no_kind_is_forgotten() -> None:
    assert set(EVERY.BLOCKS) == set(BLOCKS.own()), "give each kind an entry in tests/runner/every_kind.py"


@pytest.mark.parametrize(("kind", "variant"), by_first_way(VARIANTS))
def test_equal_seeds_make_equal_sessions(kind: str, variant: int) -> None:
    one, again = (_play(EVERY.blocks_of(kind, variant), EVERY.Fickle(5)) for _ in range(2))
    assert one.shown == again.shown
    assert one.trials == again.trials
    assert one.pooled == again.pooled


@pytest.mark.promise("one-engine")
@pytest.mark.parametrize(("kind", "variant"), VARIANTS)
def test_whoever_answers_without_eyes_comes_to_its_end(kind: str, variant: int) -> None:
    block = EVERY.blocks_of(kind, variant)[1]
    play = _play((block,), Plain())
    assert {key for ask in play.asks for key in ask.keys} >= set(block.keys)
    if kind in EVERY.OPEN_ENDED:
        assert block.trials > 0
    else:
        assert sum(trial.kind not in WORDS for trial in play.trials) == block.trials


@pytest.mark.parametrize(("kind", "variant"), VARIANTS)
def test_records_are_of_its_kind_plain_and_timed(kind: str, variant: int) -> None:
    block = EVERY.blocks_of(kind, variant)[1]
    play = _play((block,), EVERY.Fickle(7))
    assert {trial.kind for trial in play.trials} == {kind}
    assert play.shown_at_record[-1] == len(play.shown)  # no scene comes after the last record
    assert sorted(play.shown_at_record) == play.shown_at_record
    for trial in play.trials:
        json.dumps(trial.to_json(), allow_nan=False)
        assert 0 <= trial.response_time_s <= sum(seconds for _, seconds in trial.events) + 1e-9
    names = {name for ask in play.asks for name in ask.scene.stimuli} | {n for s in play.shown for n in s.stimuli}
    assert names <= {*"abcdef", *block.pictures}


@pytest.mark.parametrize(("kind", "variant"), VARIANTS)
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.stress) for seed in (1, 2))])
def test_what_it_records_is_read_as_it_was(kind: str, variant: int, seed: int, tmp_path: Path) -> None:
    """The reader defines the format: each kind's records have the fields of `analysis.kinds.kinds`."""
    play = _play(EVERY.blocks_of(kind, variant), EVERY.Fickle(seed))
    file = tmp_path / "session.jsonl"
    lines = [HEADER.to_json(), *(record.to_json() for record in _in_order(play.trials, play.pooled))]
    file.write_text("".join(json.dumps(line) + "\n" for line in lines))
    assert read_session(file).answers == tuple(play.trials)
    assert read_session(file).pooled == tuple(play.pooled)
    if play.pooled:
        file.write_text("".join(json.dumps(line) + "\n" for line in lines if line["record"] != "pool" or line["trial"]))
        with pytest.raises(InputError):
            read_session(file)


def _in_order(trials: Sequence[Trial], pooled: Sequence[PooledBatch]) -> list[Trial | PooledBatch]:
    """Return the records of a session in the order of its log: each batch before its first trial."""
    return sorted([*trials, *pooled], key=lambda record: (*record.place, isinstance(record, Trial)))


@pytest.mark.extensions
def test_every_kind_has_a_record() -> None:
    assert set(EVERY.BLOCKS) == {*KINDS, PRACTICE}, "give each kind a line in analysis/kinds/kinds.py"


@pytest.mark.promise("no-answer-lost")
@pytest.mark.parametrize(("kind", "variant"), by_first_way(VARIANTS))
def test_it_is_resumed_from_any_answer(kind: str, variant: int) -> None:
    """With any first part of its log, the rest is asked and shown as it was, and what is logged is not shown again."""
    blocks = EVERY.blocks_of(kind, variant)
    whole = _play(blocks, EVERY.Fickle(11))
    pressed = [(key, seconds) for trial in whole.trials for key, seconds in trial.events]
    for answered in range(len(whole.trials) + 1):
        before = sum(len(trial.events) for trial in whole.trials[:answered])
        reached = whole.trials[answered - 1].place if answered else (-1, 0)
        logged = [batch for batch in whole.pooled if batch.place <= reached]
        rest = _play(blocks, _Scripted(pressed[before:]), whole.trials[:answered], logged)
        assert [_told(trial) for trial in rest.trials] == [_told(trial) for trial in whole.trials[answered:]]
        assert [*logged, *rest.pooled] == whole.pooled
        since = whole.shown_at_record[answered - 1] if answered else 0
        assert rest.shown == whole.shown[since:][len(whole.shown[since:]) - len(rest.shown) :]


@dataclass
class _Scripted:
    """Presses what was pressed, as long after each onset."""

    pressed: list[tuple[str, float]]

    def __post_init__(self) -> None:
        self.pressed = list(self.pressed)

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        key, seconds = self.pressed.pop(0)
        return KeyPress(key, onset_s + seconds)


SHUFFLED = ("all_pairs", "active_pairs", "best_of_series", "rating", "preference", "practice", "screening", "threshold")


@pytest.mark.parametrize("kind", SHUFFLED)
def test_observers_meet_it_in_orders_of_their_own(kind: str) -> None:
    shown = set()
    for observer in ("01", "02", "03", "04", "05", "06"):
        play = _play(EVERY.blocks_of(kind, 0, observer)[1:2], Plain())
        shown.add(tuple(scene.stimuli for scene in play.shown))
    assert len(shown) >= 3
