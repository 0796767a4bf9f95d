"""Hundreds of SIGKILLs over all kinds of blocks and all phases, the checksums and the copy compared after each."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from analysis.records import FILE_NAME
from tests.runner.every_kind import VARIANTS
from tests.runner.killing import check_rounds, killer
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress
KILLS = how_many(400, 1000)


def test_hundreds_of_kills_lose_nothing_change_nothing_and_leave_whole_copies(tmp_path: Path) -> None:
    if not hasattr(os, "fork"):
        pytest.skip("processes are forked here, so that killing many takes no time")
    kills = sessions = 0
    with killer(tmp_path / "errors.txt") as killed:
        while kills < KILLS:
            kind, variant = VARIANTS[sessions % len(VARIANTS)]
            folder = tmp_path / str(sessions)
            folder.mkdir()
            rounds = killed(folder, kind, variant, 10_000 + sessions)
            check_rounds(rounds)
            # The last kill may come between the end line and the end of the process: the copy is then caught up later.
            if rounds[-1]["told"] and rounds[-1]["told"][-1][0] == "end":
                assert (folder / "copies" / FILE_NAME).read_bytes() == (folder / "s" / FILE_NAME).read_bytes()
            kills += len(rounds)
            sessions += 1
    print(f"{kills} kills of {sessions} sessions")
