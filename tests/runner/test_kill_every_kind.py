"""Every kind of block, killed with SIGKILL at random moments with notes and marks in between, goes on to its end."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from analysis.records.session_record import FILE_NAME, Note, Trial, read_session
from runner.ports import Ask, Holding, KeyPress
from runner.presenter.scene import Scene
from runner.session.session import Session
from tests.runner import every_kind as EVERY
from tests.runner.every_kind import VARIANTS

HERE = Path(__file__).parent
Kill = Callable[..., list[Any]]


class _Nobody:
    """A screen, an observer and a sink of which nothing may be wanted any more."""

    def show(self, scene: Scene) -> float:
        raise AssertionError("a scene is shown although the log holds everything")

    def prefetch(self, scene: Scene) -> None:
        raise AssertionError("a scene is prefetched although the log holds everything")

    def hold(self, scene: Scene, seconds: float) -> Holding:
        raise AssertionError("a scene is held although the log holds everything")

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        raise AssertionError("something is asked although the log holds everything")

    def append(self, trial: Trial) -> None:
        raise AssertionError("a trial is recorded although the log holds everything")

    def note(self, note: Note) -> None:
        raise AssertionError

    def mark(self, mark: Any) -> None:
        raise AssertionError

    def answers(self) -> Sequence[Trial]:
        return ()

    def end(self, facts: Any) -> None:
        pass


@pytest.fixture(scope="module")
def kill(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Kill]:
    """Kill a session of (folder, kind, variant, seed) until it is complete; return what each round told."""
    if not hasattr(os, "fork"):
        pytest.skip("processes are forked here, so that killing many takes no time")
    errors = tmp_path_factory.mktemp("killing") / "errors.txt"
    with (
        errors.open("w") as stderr,
        subprocess.Popen(
            [sys.executable, "-m", "tests.runner.killing_sessions"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=stderr,
            text=True,
            cwd=HERE.parents[1],
        ) as program,
    ):
        asked, told = program.stdin, program.stdout
        assert asked is not None
        assert told is not None

        def killed(folder: Path, *words: object) -> list[Any]:
            asked.write(json.dumps([str(folder), *words]) + "\n")
            asked.flush()
            rounds = []
            for line in told:
                rounds.append(json.loads(line))
                if rounds[-1] is None:
                    return rounds[:-1]
            pytest.fail(errors.read_text())

        yield killed
        asked.close()


@pytest.mark.parametrize(("kind", "variant"), VARIANTS)
def test_killed_again_and_again(kind: str, variant: int, tmp_path: Path, kill: Kill) -> None:
    rounds = kill(tmp_path, kind, variant, 100 * VARIANTS.index((kind, variant)))
    before: dict[str, list[Any]] = {"answers": [], "notes": [], "marks": []}
    for told in rounds:
        for what, *words in told["told"]:
            assert what != "error", words
            if what == "answer":
                assert words in told["answers"]
            elif what == "note":
                assert words[0] in told["notes"]
            elif what == "mark":
                assert words in told["marks"]
            else:
                assert told["complete"]
        for what, kept in before.items():
            assert told[what][: len(kept)] == kept  # what was on disk stays there, in its order
            before[what] = told[what]
    assert rounds[-1]["complete"]
    assert len(rounds) > 1  # it was killed at least once on its way
    assert all(not told["complete"] for told in rounds[:-1])
    log = read_session(tmp_path / "s" / FILE_NAME)
    assert log.pending == ()
    assert len(set(rounds[-1]["notes"])) == len(rounds[-1]["notes"])
    _is_whole(log.first_attempts, log.answers)
    # Read again from its log alone, the session asks nothing more.
    nobody = _Nobody()
    Session(EVERY.blocks_of(tmp_path, kind, variant), nobody, nobody, nobody, logged=log.first_attempts).run()


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
