"""Every kind of block, killed with SIGKILL at random moments with notes and marks in between, goes on to its end."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from analysis.kinds import Trial
from analysis.records import FILE_NAME, read_session
from runner.session import Resumed, Session
from tests.runner import every_kind as EVERY
from tests.runner.every_kind import VARIANTS
from tests.runner.killing import Kill, check_rounds, killer


@pytest.fixture(scope="module")
def kill(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Kill]:
    """Kill a session of (folder, kind, variant, seed) until it is complete; return what each round told."""
    if not hasattr(os, "fork"):
        pytest.skip("processes are forked here, so that killing many takes no time")
    with killer(tmp_path_factory.mktemp("killing") / "errors.txt") as killed:
        yield killed


# A kill in plain trials, and in batches; the others nightly.
FEW = [("rating", 0), ("active_pairs", 3)]


def _marks(kind: str, variant: int) -> list[pytest.MarkDecorator]:
    marks = [] if (kind, variant) in FEW else [pytest.mark.nightly]
    return [*marks, pytest.mark.extensions] if kind in EVERY.OF_EXTENSIONS else marks


@pytest.mark.promise("no-answer-lost")
@pytest.mark.parametrize(("kind", "variant"), [pytest.param(*one, marks=_marks(*one)) for one in VARIANTS])
def test_killed_again_and_again(kind: str, variant: int, tmp_path: Path, kill: Kill) -> None:
    rounds = kill(tmp_path, kind, variant, 100 * VARIANTS.index((kind, variant)))
    check_rounds(rounds)
    assert len(rounds) > 1  # it was killed at least once on its way
    log = read_session(tmp_path / "s" / FILE_NAME)
    assert log.pending == ()
    assert len(set(rounds[-1]["notes"])) == len(rounds[-1]["notes"])
    _is_whole(log.first_attempts, log.answers)
    # Read again from its log alone, the session asks nothing more.
    blocks, stage = EVERY.blocks_of(kind, variant), EVERY.Stage()
    Session(blocks, stage, stage, stage, Resumed.of(log)).run()  # type: ignore[arg-type]  # one stage stands for all
    assert (stage.shown, stage.trials, stage.pooled, len(stage.ends)) == ([], [], [], 1)


def _is_whole(first: Sequence[Trial], answers: Sequence[Trial]) -> None:
    """Say whether each trial of each block stands there once, in order, and each attempt after the one before."""
    assert {trial.block for trial in first} == {0, 1, 2}
    for block in range(3):
        assert [trial.trial for trial in first if trial.block == block] == list(
            range(sum(trial.block == block for trial in first))
        )
    attempts: dict[tuple[int, int], int] = {}
    for answer in answers:
        assert answer.attempt == attempts.get(answer.place, -1) + 1
        attempts[answer.place] = answer.attempt
