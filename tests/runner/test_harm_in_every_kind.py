"""In each kind of block and each phase, each file that a session owns vanishes, shrinks or is replaced once."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from analysis.kinds import Trial
from analysis.records import FILE_NAME, read_session, session_files
from analysis.seals import check_log, copy_in_mirror
from documents.files import LogDisturbedError
from documents.files import mirror as mirror_module
from runner.session import Session
from runner.session.folders import LogMirror
from tests.runner.every_kind import VARIANTS, Fickle, OnTrial, Stage, blocks_of, opened
from tests.runner.harms import TO_FILE, Harm

pytestmark = pytest.mark.nightly

HARMS: dict[str, Harm] = {"vanishes": Path.unlink, "shrinks": TO_FILE["cut off"], "is replaced": TO_FILE["replaced"]}
FILES = (FILE_NAME, ".lock", ".lock.owner")
FIRSTS = [
    (kind, variant) if variant == 0 else pytest.param(kind, variant, marks=pytest.mark.stress)
    for kind, variant in VARIANTS
]


def sit(folder: Path, kind: str, variant: int, harmed_after: int, file: str, harm: str) -> tuple[list[Trial], bool]:
    """Run a session, or resume it, and return what was kept, and whether it was stopped by what was done to a file."""
    kept: list[Trial] = []
    recorder, before = opened(folder)

    def on_trial(trial: Trial) -> None:
        kept.append(trial)
        if len(kept) == harmed_after:
            HARMS[harm](folder / file)

    session = Session(blocks_of(kind, variant), Stage(), Fickle(1), recorder, before)
    session.listeners.append(OnTrial(on_trial))
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


def mirrored(folder: Path, kind: str, variant: int, harmed_after: int, harm: Harm | None) -> tuple[Path, str | None]:
    """Run a session whose log is copied; return the copy, to which something was done, and what was said of it."""
    recorder, _ = opened(folder / "e" / "sub-01" / "ses-1")
    copies = folder / "copies"
    copies.mkdir()
    copy = copy_in_mirror(recorder.folder / FILE_NAME, copies)
    mirror = LogMirror(recorder.log, copy, copies)
    kept: list[Trial] = []

    def on_trial(trial: Trial) -> None:
        kept.append(trial)
        if len(kept) == harmed_after and harm is not None:
            end = time.monotonic() + 60
            while not (copy.exists() and copy.stat().st_size == recorder.log.size) and time.monotonic() < end:
                time.sleep(0.001)
            harm(copy)

    with recorder:
        session = Session(blocks_of(kind, variant), Stage(), Fickle(1), recorder)
        session.listeners += [mirror, OnTrial(on_trial)]
        session.run()
    return copy, mirror.close(60)


@pytest.mark.parametrize(("kind", "variant"), FIRSTS)
def test_the_copy_is_whole_at_the_end_or_it_is_said(
    kind: str, variant: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mirror_module, "_AGAIN_S", 0.05)
    copy, said = mirrored(tmp_path / "whole", kind, variant, 0, None)
    trials = len(read_session(copy).trials)
    for phase in sorted({1, (trials + 1) // 2, trials}):
        for harm, done in {**HARMS, "is edited": TO_FILE["edited"], "is added to": TO_FILE["added to"]}.items():
            copy, said = mirrored(tmp_path / f"{phase} {harm}", kind, variant, phase, done)
            (log,) = session_files(tmp_path / f"{phase} {harm}" / "e")
            assert read_session(log).complete
            if harm in HARMS:
                assert (said, copy.read_bytes()) == (None, log.read_bytes()), (phase, harm)
            else:  # what another program wrote there is left as it is
                assert said is not None
                assert str(copy) in said
                assert "another line" in said
