"""Export session logs as a BIDS dataset, a session at a time.

A session has a table of answers, a row for each trial that counts, and a table of events: answers that a later attempt
replaced, marks, notes, and the times at which the session was resumed.
"""

from __future__ import annotations

import hashlib
import re
import shutil
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

from analysis.errors import ResultsError
from analysis.records import Header, Record, SessionLog, SessionTimes, WhoAnswered, kept_files, read_session
from documents import Finding
from documents.files import MOST_LOG_BYTES, read_regular
from documents.text import counted
from extensions.bids.columns import FIXED, BidsColumn, ColumnCollector, flatten
from extensions.bids.dataset import check_replaceable, replacing, write_dataset_files
from extensions.bids.sidecars import EVENT_DEFINITIONS, describe, fixed, session_sidecar, task_sidecar, trial_type
from extensions.bids.sources import Source, find_sources, log_files, without_simulated
from extensions.bids.text import MISSING, cell, write_json, write_table
from runner.reports import About as About
from runner.reports import Exported

Progress = Callable[[str, int, int], None]
FactsOf = Callable[[Header, Collection[str], Path], Mapping[str, str]]


@dataclass(frozen=True, slots=True)
class Export(Exported):
    """What was exported; ``copies`` are pairs of the file that was exported and its copy.

    ``who`` says who answered in them, ``left_out`` how many sessions of simulated observers are not in the dataset,
    ``notes`` how many notes in words there are.
    ``doubts`` are sentences on observers' codes that may be of two people, or were changed.
    """

    participants: int
    tasks: Mapping[str, str]
    copies: tuple[tuple[Path, Path], ...]
    notes: int
    who: WhoAnswered
    left_out: int = 0
    doubts: tuple[str, ...] = ()
    json_names: ClassVar = "folder participants sessions trials tasks copies notes doubts simulated left_out"
    json_keys: ClassVar = {"left_out": "simulated_left_out"}

    @property
    def simulated(self) -> int:
        """How many of the sessions are of simulated observers."""
        return self.who.simulated_sessions

    def told(self) -> Iterator[str]:
        """Yield notes on what was exported, and what is in the dataset."""
        yield from (f"note: {copy} is a copy of {kept} and is exported once" for kept, copy in self.copies)
        yield from (f"note: {sentence}" for sentence in (*self.doubts, *self._on_simulated()))
        if self.notes:
            yield (
                f"note: {counted(self.notes, 'note in free text is', 'notes in free text are')} in the dataset; "
                f"read {'it' if self.notes == 1 else 'them'} before you share it"
            )
        yield (
            f"{counted(self.sessions, 'session', 'sessions')} of "
            f"{counted(self.participants, 'participant', 'participants')}, {counted(self.trials, 'trial', 'trials')}, "
            f"as {', '.join(f'task-{label}' for label in self.tasks)}: {self.folder}"
        )

    def _on_simulated(self) -> Iterator[str]:
        if self.left_out:
            are = "session of a simulated observer is" if self.left_out == 1 else "sessions of simulated observers are"
            yield f"{self.left_out} {are} left out, beside those of people; --with-simulated exports them too"
        if self.who.all_simulated:
            yield "all sessions are of simulated observers"
        elif self.who.are_mixed:
            shared = self.who.shared
            same = f"; a person and a simulated observer share the code {', '.join(shared)}" if shared else ""
            are = "is" if self.simulated == 1 else "are"
            yield f"{self.simulated} of {self.sessions} sessions {are} simulated, by the column simulated{same}"


@dataclass(slots=True)
class _Task:
    collector: ColumnCollector = field(default_factory=ColumnCollector)
    columns: tuple[BidsColumn, ...] = ()
    whole: frozenset[str] = frozenset()
    has_events: bool = False
    first: tuple[Header, Path] | None = None
    versions: set[str] = field(default_factory=set)


def export_dataset(
    results: Sequence[Path],
    folder: Path,
    about: About | None = None,
    progress: Progress = lambda what, done, of: None,
    *,
    facts: FactsOf = lambda header, versions, file: {},
) -> Export:
    """Export every session in ``results`` as a BIDS dataset.

    Each log is read twice, so that all tables of a task have the same columns and no more than one session is in
    memory.

    Parameters
    ----------
    results
        Folders of sessions, from one station or many, or single session logs.
    folder
        Folder of the dataset. An earlier export is replaced, once the new dataset is complete.
    about
        Name, authors and licence, and whether sessions of simulated observers are exported beside those of people.
    progress
        Called with what is done, how many sessions are done, and how many there are.
    facts
        Called with the header of an experiment's first session, the SHA-256 of the experiment files of all, and the
        first session's log: returns what a paper must say of it and no log can, by the code of the item.

    Returns
    -------
    What was exported: numbers of participants, sessions and trials, task labels, and copies that were left out.

    Raises
    ------
    ResultsError
        If there is no session, logs are damaged or contradict each other, or ``folder`` has other files.
    OSError
        If it cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from runner.session import simulate
    >>> experiment, observers = "experiments/dynamic_range.yaml", "configs/observers/table_4_4.yaml"
    >>> with TemporaryDirectory() as place:
    ...     results, dataset = Path(place) / "results", Path(place) / "bids"
    ...     simulated = simulate(experiment, observers, 1, results=results)
    ...     exported = export_dataset([results], dataset)
    ...     sorted(file.name for file in dataset.iterdir())[:3]
    ['CHANGES', 'README', 'dataset_description.json']
    >>> exported.sessions, exported.trials, dict(exported.tasks)
    (1, 46, {'dynamicrange': 'dynamic_range'})
    """
    folder = folder.resolve()
    check_replaceable(folder)
    about = about or About()
    files, left_out = without_simulated(log_files(results, folder), with_simulated=about.with_simulated)
    tasks: dict[str, _Task] = {}

    def collect(source: Source, log: SessionLog) -> None:
        task = tasks.setdefault(source.task, _Task())
        task.first = task.first or (log.header, source.file)
        task.versions.add(str(log.header.hashes.get("experiment")))
        collector = task.collector
        stimuli = frozenset(log.header.stimulus_names)
        for trial in log.trials:
            collector.add(trial, stimuli)

    def with_counts() -> Any:
        for number, file in enumerate(files):
            progress("Reading sessions", number, len(files))
            yield file
        progress("Reading sessions", len(files), len(files))

    read = find_sources(with_counts(), collect)
    for task in tasks.values():
        task.columns, task.whole = task.collector.columns(), task.collector.whole
    first = [(*task.first, task.versions) for task in tasks.values() if task.first is not None]
    given = {header.experiment: facts(header, versions, file) for header, file, versions in first}
    trials = notes = 0
    changes = folder / "CHANGES"
    before = (
        read_regular(changes, _MOST_BYTES, error=ResultsError).decode("utf-8", "replace") if changes.is_file() else None
    )
    with replacing(folder) as part:
        for number, source in enumerate(read.sources):
            progress("Writing sessions", number, len(read.sources))
            log = _copy(source, part / source.raw)
            trials += _write_session(source, log, tasks[source.task], part)
            notes += len(log.notes)
            _copy_configuration(source, part)
        for label, task in tasks.items():
            _write_descriptions(part, label, task)
        write_dataset_files(part, replace(about, facts=given), read.sources, before)
    progress("Writing sessions", len(read.sources), len(read.sources))
    return Export(
        folder,
        len(read.sources),
        trials,
        len({source.observer for source in read.sources}),
        {source.task: source.experiment for source in read.sources},
        read.copies,
        notes,
        WhoAnswered.of((source.observer, source.simulated) for source in read.sources),
        left_out,
        read.doubts,
    )


def _copy(source: Source, target: Path) -> SessionLog:
    content = read_regular(source.file, MOST_LOG_BYTES, "results", error=ResultsError)
    if hashlib.sha256(content).hexdigest() != source.digest:
        raise ResultsError(
            Finding("the session changed while it was exported", str(source.file), remedy="export it after the session")
        )
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_bytes(content)
    return read_session(target)


def _copy_configuration(source: Source, part: Path) -> None:
    """Copy the files that the session was made with, unless those of another session were the same."""
    for name, file in kept_files(source.file).items():
        copy = part / "sourcedata" / source.task / name
        if not copy.exists():
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(file, copy)


def _write_session(source: Source, log: SessionLog, task: _Task, part: Path) -> int:
    place = part / source.folder
    place.mkdir(parents=True, exist_ok=True)
    rows = answer_rows(log, task.columns, frozenset(log.header.stimulus_names), task.whole)
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


EVENT_COLUMNS = ("onset", "duration", "trial_type", "block", "trial", "attempt", "by", "response_time", "utc", "value")
_MOST_BYTES = 10_000_000
_BIDS_TIME = re.compile(
    r"\d{4}-(0[1-9]|1[0-2])-(0[1-9]|[12]\d|3[01])T([01]\d|2[0-3]):[0-5]\d:[0-5]\d(\.\d{1,6})?(Z|[+-]([01]\d|2[0-3]):[0-5]\d)?",
    re.ASCII,
)


def time_cell(utc: object) -> str:
    """Return a time as a cell, ``n/a`` if it is not valid."""
    return utc if isinstance(utc, str) and _BIDS_TIME.fullmatch(utc) else MISSING


def answer_columns(columns: Sequence[BidsColumn]) -> tuple[str, ...]:
    """Return the names of the table's columns."""
    return (*FIXED, *(column.name for column in columns))


def answer_rows(
    log: SessionLog, columns: Sequence[BidsColumn], stimuli: Collection[str], whole: Collection[str]
) -> Iterator[tuple[str, ...]]:
    """Yield the rows of a session's table as cells, in the order in which the trials were first answered."""
    times = SessionTimes.of(log)
    for trial in log.trials:
        recorded = dict(flatten(trial.details(), stimuli, whole))
        yield (
            cell(times.onset_s(trial)),
            cell(trial.block),
            cell(trial.trial),
            cell(trial.attempt),
            cell(trial.kind),
            cell(trial.response_time_s),
            time_cell(trial.utc),
            cell([list(event) for event in trial.events]),
            cell(log.header.simulated),
            *(cell(recorded.get(column.place)) for column in columns),
        )


def _whole(number: object) -> str:
    return cell(number) if isinstance(number, int) and not isinstance(number, bool) else MISSING


def event_rows(log: SessionLog) -> list[tuple[str, ...]]:
    """Return the rows of a session's table of events as cells, by time; rows without a time are last."""
    counting = {id(trial) for trial in log.trials}
    times = SessionTimes.of(log)
    timed: list[tuple[float | None, tuple[str, ...]]] = []

    def add(record: Record, *cells: str) -> None:
        onset = times.onset_s(record)
        kind, block, trial, attempt, by, response_time, value = cells
        row = (cell(onset), MISSING, kind, block, trial, attempt, by, response_time, time_cell(record.utc), value)
        timed.append((onset, row))

    for answer in log.answers:
        if id(answer) not in counting:
            what = cell({**answer.details(), "kind": answer.kind})
            place = (cell(answer.block), cell(answer.trial), cell(answer.attempt))
            add(answer, "superseded_answer", *place, MISSING, cell(answer.response_time_s), what)
    for mark in log.marks:
        add(mark, "mark", _whole(mark.block), _whole(mark.trial), MISSING, cell(mark.by), MISSING, MISSING)
    for note in log.notes:
        by, text = cell(note.by), cell(note.text)
        add(note, "note", _whole(note.block), _whole(note.trial), MISSING, by, MISSING, text)
    for resumption in log.resumptions:
        facts = resumption.to_json()["accepted_changes"]
        if stop := times.stop(resumption):
            facts |= {"gap_s": stop.gap_s, "clock_behind_s": stop.clock_behind_s}
        if resumption.software:
            facts |= {"software": resumption.software}
        changes = cell(facts) if facts else MISSING
        add(resumption, "resumption", MISSING, MISSING, MISSING, MISSING, MISSING, changes)
    timed.sort(key=lambda item: (item[0] is None, item[0] or 0.0))
    return [row for _, row in timed]
