"""In each kind of block and each phase, each file that a session owns vanishes, shrinks or is replaced once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from analysis.records import FILE_NAME, Trial, check_log, read_session
from documents.files import LogDisturbedError
from runner.session import Session
from runner.session.folders import Recorder
from tests.runner.every_kind import VARIANTS, Fickle, blocks_of
from tests.runner.harms import TO_FILE, Harm
from tests.runner.killing_sessions import HEADER, Screen

HARMS: dict[str, Harm] = {"vanishes": Path.unlink, "shrinks": TO_FILE["cut off"], "is replaced": TO_FILE["replaced"]}
FILES = (FILE_NAME, ".lock", ".lock.owner")
FIRSTS = [
    (kind, variant) if variant == 0 else pytest.param(kind, variant, marks=pytest.mark.stress)
    for kind, variant in VARIANTS
]


def sit(folder: Path, kind: str, variant: int, harmed_after: int, file: str, harm: str) -> tuple[list[Trial], bool]:
    """Run a session, or resume it, and return what was kept, and whether it was stopped by what was done to a file."""
    kept: list[Trial] = []
    known: dict[str, Any] = {}
    if (folder / FILE_NAME).exists():
        recorder, log = Recorder.reopen(folder)
        known = {"logged": log.first_attempts, "pending": log.pending, "batches": log.pooled}
    else:
        recorder = Recorder.create(folder, HEADER)

    def on_trial(trial: Trial) -> None:
        kept.append(trial)
        if len(kept) == harmed_after:
            HARMS[harm](folder / file)

    session = Session(blocks_of(kind, variant), Screen(), Fickle(1), recorder, on_trial=on_trial, **known)
    try:
        with recorder:
            session.run()
    except LogDisturbedError as error:
        return kept, error.saved == folder / FILE_NAME
    return kept, False


@pytest.mark.parametrize(("kind", "variant"), FIRSTS)
def test_nothing_that_was_kept_is_lost(kind: str, variant: int, tmp_path: Path) -> None:
    whole, stopped = sit(tmp_path / "whole", kind, variant, 0, FILE_NAME, "vanishes")
    assert not stopped
    for phase in sorted({1, (len(whole) + 1) // 2, len(whole)}):
        for number, file in enumerate(FILES):
            for harm in HARMS:
                folder = tmp_path / f"{phase}_{number}_{harm}"
                kept, stopped = sit(folder, kind, variant, phase, file, harm)
                if file == FILE_NAME or (file == ".lock.owner" and harm != "is replaced"):
                    assert stopped, (phase, file, harm)
                assert len(kept) <= phase + 1 or not stopped  # it stops before another answer is asked for
                log = read_session(folder / FILE_NAME)
                assert check_log(log.file).findings == (), (phase, file, harm)
                given = [(trial.place, trial.attempt, trial.utc) for trial in kept]
                assert [(trial.place, trial.attempt, trial.utc) for trial in log.trials][: len(given)] == given
                if not log.complete:
                    sit(folder, kind, variant, 0, file, harm)
                assert read_session(folder / FILE_NAME).complete
