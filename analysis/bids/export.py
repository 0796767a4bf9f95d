"""From the logs of sessions to a BIDS dataset, one session at a time."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from analysis.bids.columns import FIXED, Column, ColumnCollector
from analysis.bids.dataset import About, check_replaceable, replacing, write_dataset_files
from analysis.bids.sidecars import describe, fixed, session_sidecar, task_sidecar, trial_type
from analysis.bids.sources import Source, find_sources, log_files
from analysis.bids.tables import EVENT_COLUMNS, EVENT_DEFINITIONS, answer_columns, answer_rows, check_trial, event_rows
from analysis.bids.text import write_json, write_table
from analysis.errors import ResultsError
from analysis.records.session_record import SessionLog, read_session
from documents import Finding

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, slots=True)
class Export:
    """What was exported; ``copies`` are pairs of the file that was taken and the one that was the same.

    ``simulated`` is how many of the sessions are of simulated observers.
    """

    folder: Path
    participants: int
    sessions: int
    trials: int
    tasks: Mapping[str, str]
    copies: tuple[tuple[Path, Path], ...]
    notes: int
    simulated: int

    def to_json(self) -> dict[str, Any]:
        """Return the export as an object for JSON."""
        copies = [[str(kept), str(copy)] for kept, copy in self.copies]
        return {**asdict(self), "folder": str(self.folder), "tasks": dict(self.tasks), "copies": copies}


@dataclass(slots=True)
class _Task:
    collector: ColumnCollector = field(default_factory=ColumnCollector)
    columns: tuple[Column, ...] = ()
    whole: frozenset[str] = frozenset()
    has_events: bool = False


def export_dataset(
    results: Sequence[Path],
    folder: Path,
    about: About | None = None,
    progress: Progress = lambda what, done, of: None,
) -> Export:
    """Write every session in ``results`` (folders of sessions, or session logs) as a BIDS dataset into ``folder``.

    Each log is read twice, so that all tables of a task have the same columns and no more than one session is in
    memory. ``folder`` is replaced if it holds an earlier export, and appears whole or not at all.

    Raises
    ------
    ResultsError
        If there is no session, logs are damaged or contradict one another, or ``folder`` holds something else.
    OSError
        If it cannot be written.
    """
    folder = folder.resolve()
    check_replaceable(folder)
    files = log_files(results, folder)
    tasks: dict[str, _Task] = {}

    def hear(source: Source, log: SessionLog) -> None:
        collector = tasks.setdefault(source.task, _Task()).collector
        stimuli = _names(log)
        for trial in log.answers:
            check_trial(trial, log)
        for trial in log.trials:
            collector.add(trial, stimuli)

    def counted() -> Any:
        for number, file in enumerate(files):
            progress("Reading sessions", number, len(files))
            yield file
        progress("Reading sessions", len(files), len(files))

    found = find_sources(counted(), hear)
    for task in tasks.values():
        task.columns, task.whole = task.collector.columns(), task.collector.whole
    trials = notes = simulated = 0
    changes = folder / "CHANGES"
    before = changes.read_text(encoding="utf-8", errors="replace") if changes.is_file() else None
    with replacing(folder) as part:
        for number, source in enumerate(found.sources):
            progress("Writing sessions", number, len(found.sources))
            log = _copy(source, part / source.raw)
            trials += _write_session(source, log, tasks[source.task], part)
            notes += len(log.notes)
            simulated += log.header.simulated
        for label, task in tasks.items():
            _write_descriptions(part, label, task)
        write_dataset_files(part, about or About(), found.sources, before)
    progress("Writing sessions", len(found.sources), len(found.sources))
    return Export(
        folder,
        len({source.observer for source in found.sources}),
        len(found.sources),
        trials,
        {source.task: source.experiment for source in found.sources},
        found.copies,
        notes,
        simulated,
    )


def _names(log: SessionLog) -> frozenset[str]:
    return frozenset(str(stimulus.get("name")) for stimulus in log.header.stimuli)


def _copy(source: Source, target: Path) -> SessionLog:
    content = source.file.read_bytes()
    if hashlib.sha256(content).hexdigest() != source.digest:
        raise ResultsError(
            Finding("the session changed while it was exported", str(source.file), remedy="export it once it is done")
        )
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_bytes(content)
    return read_session(target)


def _write_session(source: Source, log: SessionLog, task: _Task, part: Path) -> int:
    place = part / source.folder
    place.mkdir(parents=True, exist_ok=True)
    rows = answer_rows(log, task.columns, _names(log), task.whole)
    trials = write_table(place / f"{source.name}_beh.tsv", answer_columns(task.columns), rows)
    write_json(place / f"{source.name}_beh.json", session_sidecar(source, log))
    events = event_rows(log)
    if events:
        task.has_events = True
        write_table(place / f"{source.name}_events.tsv", EVENT_COLUMNS, events)
        write_json(place / f"{source.name}_events.json", task_sidecar(source, log))
    return trials


def _write_descriptions(part: Path, label: str, task: _Task) -> None:
    kinds = tuple(task.collector.kinds)
    described = {name: trial_type(kinds) if name == "trial_type" else fixed(name) for name in FIXED}
    described |= {column.name: describe(column) for column in task.columns}
    write_json(part / f"task-{label}_beh.json", described)
    if task.has_events:
        write_json(part / f"task-{label}_events.json", EVENT_DEFINITIONS)
