"""Experiments taken the whole way: whatever `check` accepts is run, reported, exported and replayed."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

from rich.console import Console

from analysis.records import FILE_NAME, SessionLog, read_session
from analysis.report import describe, report_blocks, write_report
from documents.pages import print_blocks
from extensions.bids import export_dataset
from runner.check import CheckOptions, check_file
from runner.session import SessionOptions, run_session, simulate

OBSERVERS = 2


def whole_way(file: Path, observers: Path, folder: Path, *, page: bool = True) -> bool:
    """Take an experiment the whole way and return True; False if `check` refuses it.

    Without ``page`` the results are computed and printed, and no figure is drawn, which takes longer than all else.
    ``folder`` must be new.
    """
    results = folder / "results"
    if check_file(file, CheckOptions(screen=False, results=results)).errors:
        return False
    done = simulate(file, observers, OBSERVERS, results=results)
    logs = [read_session(session / FILE_NAME) for session in done.folders]
    assert all(log.complete for log in logs)
    _report(logs, folder if page else None)
    exported = export_dataset([results], folder / "bids")
    assert exported.sessions == OBSERVERS
    assert exported.trials == sum(len(log.trials) for log in logs)
    again = run_session(file, "01", SessionOptions(folder / "replayed", replay=logs[0].file))
    assert again.folder is not None
    assert _said(read_session(again.folder / FILE_NAME)) == _said(logs[0])
    return True


def _report(logs: list[SessionLog], folder: Path | None) -> None:
    if folder is None:
        report = describe(logs)
    else:
        report = write_report(logs, folder / "report.html", csv_folder=folder / "tables")
        assert (folder / "report.html").stat().st_size > 1000
    json.dumps(report.to_json(), allow_nan=False)
    print_blocks(report_blocks(report), Console(file=io.StringIO()))


def _said(log: SessionLog) -> list[Any]:
    """Return what the answers say, but for how long scenes stood."""
    return [
        (
            answer.place,
            answer.attempt,
            answer.kind,
            answer.events,
            {k: v for k, v in answer.details().items() if k != "timed"},
        )
        for answer in log.answers
    ]
