"""What Python can call in place of a command: a session, simulated observers."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from analysis.kinds import Trial
from analysis.records import FILE_NAME, read_session
from analysis.report import write_report
from documents import InputError
from runner.blocks import Block, Draw
from runner.errors import SessionError, SessionStoppedError
from runner.protocol import Experiment
from runner.session import Recorder, SessionOptions, run_session, simulate
from runner.session.run import Terminated
from tests.runner.every_kind import OnStatus, OnTrial

Study = Any  # tests/conftest.py


def _trials(folder: Path) -> list[tuple[Any, ...]]:
    return [(t.block, t.trial, t.kind, t.events, t.details()) for t in read_session(folder / FILE_NAME).trials]


def test_a_session_is_run_and_its_end_reported(study: Study) -> None:
    lines: list[str] = []
    places: list[str] = []
    options = SessionOptions(
        results=study.results,
        simulate=study.observers,
        notify=lines.append,
        listeners=(OnStatus(lambda status: places.append(status.line().split(" · ")[0])),),
    )
    done = run_session(study.experiment, "01", options)
    assert (done.ending, done.answered, done.trials) == ("completed", 6, 6)
    assert done.folder is not None
    assert read_session(done.folder / FILE_NAME).complete
    counts = {"ending": "completed", "answered": 6, "trials": 6, "folder": str(done.folder)}
    told = done.to_json()
    assert told.pop("work")["decodes"] == 4
    assert told == {**counts, "failed_tests": [], "screened_out": False, "doubt": ""}
    assert places[-1] == "trial 6 of 6"
    replayed = run_session(str(study.experiment), "01", SessionOptions(results=study.results, replay=done.folder))
    assert replayed.folder is not None
    assert _trials(replayed.folder) == _trials(done.folder)


def test_the_observer_s_blocks_are_made_once(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []
    make = Experiment.blocks

    def blocks(self: Experiment, observer: str, draw: Draw) -> tuple[Block, ...]:
        made.append(observer)
        return make(self, observer, draw)

    monkeypatch.setattr(Experiment, "blocks", blocks)
    run_session(study.experiment, "04", SessionOptions(results=study.results, simulate=study.observers))
    assert made == ["04"]


def test_an_answer_that_cannot_be_written_stops_the_session(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(self: Recorder, trial: Trial) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Recorder, "append", full)
    with pytest.raises(SessionStoppedError, match="Every answer before this is saved"):
        run_session(study.experiment, "01", SessionOptions(results=study.results, simulate=study.observers))


@pytest.mark.parametrize("other", [{"resume": True}, {"simulate": "observers.yaml"}])
def test_a_replay_with_anything_else_is_refused(study: Study, other: dict[str, Any]) -> None:
    with pytest.raises(SessionError, match="give only one"):
        run_session(study.experiment, "01", SessionOptions(results=study.results, replay="session.jsonl", **other))


def test_simulated_observers_answer_as_the_command_lets_them(study: Study) -> None:
    by_command = run_session(study.experiment, "02", SessionOptions(results=study.results, simulate=study.observers))
    steps: list[tuple[str, int, int]] = []
    done = simulate(
        study.experiment,
        study.observers,
        2,
        results=study.folder / "more",
        progress=lambda *step: steps.append(step),
    )
    assert [folder.parent.name for folder in done.folders] == ["sub-01", "sub-02"]
    assert by_command.folder is not None
    assert _trials(done.folders[1]) == _trials(by_command.folder)
    assert steps[-1] == ("Running simulated observers", 2, 2)
    # Two stereo pictures and two flat ones, however many observers see them.
    assert (done.work.decodes, done.work.uploads) == (4, 6)


def test_a_seed_changes_the_answers_and_not_the_trials(study: Study) -> None:
    own, other = (
        simulate(study.experiment, study.observers, ["a"], results=study.folder / f"seed-{seed}", seed=seed)
        for seed in (None, 99)
    )
    first, second = _trials(own.folders[0]), _trials(other.folders[0])
    assert [trial[:3] for trial in first] == [trial[:3] for trial in second]
    assert [t[4].get("first") for t in first] == [t[4].get("first") for t in second]
    assert first != second


def test_observers_without_a_valid_code_are_refused_before_anything_is_made(study: Study) -> None:
    with pytest.raises(InputError, match="no BIDS label"):
        simulate(study.experiment, study.observers, ["01", "../x"], results=study.results)
    assert not study.results.exists()


@pytest.mark.usefixtures("undrawn")
@pytest.mark.nightly
def test_records_with_the_former_names_of_the_counts_are_read_and_reported_alike(
    study: Study, unchained: Callable[[Path], None]
) -> None:
    """Until they were called ``clipping_costs_computed`` and ``clipping_costs_cached``, they were called otherwise."""
    former = {"clipping_costs_computed": "costs_reckoned", "clipping_costs_cached": "costs_found"}
    (folder,) = simulate(study.experiment, study.observers, results=study.results).folders
    log = folder / FILE_NAME
    unchained(log)
    new = read_session(log)
    new_page = write_report([new], study.folder / "new.html")
    *lines, last = log.read_text().splitlines()
    end = json.loads(last)
    assert set(former) <= set(end["work"])
    end["work"] = {former.get(name, name): count for name, count in end["work"].items()}
    log.write_text("\n".join([*lines, json.dumps(end)]) + "\n")
    old = read_session(log)
    assert old == new
    old_page = write_report([old], study.folder / "old.html")
    assert old_page.pairs is not None
    assert new_page.pairs is not None
    assert old_page.pairs.to_json() == new_page.pairs.to_json()
    assert (study.folder / "old.html").read_text() == (study.folder / "new.html").read_text()


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="POSIX")
def test_being_asked_to_end_is_an_interrupt_where_nobody_else_handles_it() -> None:
    def ignored(number: int, frame: object) -> None:
        pass

    before = {number: signal.signal(number, signal.SIG_DFL) for number in (signal.SIGTERM, signal.SIGHUP)}
    try:
        signal.signal(signal.SIGHUP, ignored)
        with Terminated.raised():
            ends, other = signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGHUP)
        assert callable(ends)
        assert other is ignored
        with pytest.raises(Terminated):
            ends(signal.SIGTERM, None)
        assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@pytest.mark.parametrize("error", [ValueError, SessionStoppedError])
def test_a_guest_hears_of_what_is_on_disk_and_its_own_fault_ends_nothing(study: Study, error: type[Exception]) -> None:
    on_disk: list[bool] = []

    def look(trial: Trial) -> None:
        on_disk.append(trial in read_session(study.log_file()).trials)
        if len(on_disk) == 3:
            raise error("out of paper")

    with suppress(SessionStoppedError):
        options = SessionOptions(study.results, simulate=study.observers, listeners=(OnTrial(look),))
        run_session(study.experiment, "01", options)
    log = read_session(study.log_file())
    assert (on_disk, log.complete, len(log.answers) == 3) == ([True] * 3, error is ValueError, error is not ValueError)
    assert ["out of paper" in note.text for note in log.notes] == [True] * log.complete
