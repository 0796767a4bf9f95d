"""Killing sessions again and again, and what must be true of each round: nothing lost, nothing changed, copied."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
Kill = Callable[..., list[Any]]


@contextmanager
def killer(errors: Path) -> Iterator[Kill]:
    """Yield what kills a session of (folder, kind, variant, seed) until it is complete and returns what rounds told."""
    with (
        errors.open("w") as stderr,
        subprocess.Popen(
            [sys.executable, "-m", "tests.runner.killing_sessions"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=stderr,
            text=True,
            cwd=ROOT,
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
            raise AssertionError(errors.read_text())

        yield killed
        asked.close()


def check_rounds(rounds: Sequence[Any]) -> None:
    """Check what each round told against what was then on disk, the checksums of the log, and its copy."""
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
                assert words == [None]  # nothing is wrong with the copy
        for what, kept in before.items():
            assert told[what][: len(kept)] == kept  # what was on disk stays there, in its order
            before[what] = told[what]
        assert told["findings"] == []
        assert not isinstance(told["copy"], int)  # the first line of the copy that is another one
    assert rounds[-1]["complete"]
    if ["end", None] in rounds[-1]["told"]:
        assert rounds[-1]["copy"] == "whole"
    assert all(not told["complete"] for told in rounds[:-1])
