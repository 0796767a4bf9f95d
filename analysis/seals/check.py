"""Whether logs are as they were recorded: their checksums, their records, their seal, and their copies elsewhere."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from analysis.errors import ResultsError
from analysis.records.results import result_files
from analysis.records.session_record import FILE_NAME, RecordReader, refusal
from analysis.records.versions import stays_in
from analysis.seals.seal import SEAL, SealCheck, check_seal
from analysis.seals.signing import Key, read_key
from devices.readings import is_measurement_log
from documents import Finding
from documents.files import (
    MOST_LOG_BYTES,
    RESTORE,
    DamagedLineError,
    LogState,
    compare_copy,
    looked_for,
    open_regular,
    read_lines,
    unprotected,
    unreadable,
)
from documents.options import Typed
from documents.text import JsonResult, counted, visible

_BEGINNING = 4096
_LAYOUT = 4  # EXPERIMENT/sub-OBSERVER/ses-LABEL/session.jsonl


@dataclass(frozen=True, slots=True)
class LogCheck(JsonResult):
    """A log that was checked.

    ``chained_from`` is the first line with a checksum: 1 if all have one, None if none has. ``complete`` says whether
    the end was recorded, ``torn_bytes`` how much of an unfinished last line there is, which counts for nothing.
    ``digest`` is the checksum of the last whole line, and so of all. ``findings`` name each line that does not fit, and
    what is wrong with the copy; ``mirror`` says in words how the copy compares, None if there is none to compare.
    """

    file: Path
    kind: Literal["session", "measurement"]
    lines: int
    chained_from: int | None
    complete: bool
    torn_bytes: int
    digest: str
    findings: tuple[Finding, ...]
    mirror: str | None = None
    json_keys: ClassVar = {"faults": "findings"}
    json_names: ClassVar = "file kind lines chained_from complete torn_bytes digest mirror faults"

    @property
    def checksums(self) -> str:
        """What protects the lines, in words."""
        if self.chained_from is None:
            return "unchained: nothing protects it"
        return "chained" if self.chained_from == 1 else f"chained from line {self.chained_from}"

    @property
    def ending(self) -> str:
        """How the log ends, in words."""
        words = "a measurement" if self.kind == "measurement" else "complete" if self.complete else "stopped"
        return f"{words}, its last line unfinished" if self.torn_bytes else words

    @property
    def faults(self) -> list[dict[str, Any]]:
        """The findings, each with its file, line, message and remedy."""
        return [_finding_json(finding) for finding in self.findings]


@dataclass(frozen=True, slots=True)
class ResultsCheck(JsonResult):
    """Logs and seals that were checked; ``others`` says which could not be, and which logs no seal names that must.

    ``strict`` says that a log counts as wrong also where it is unchained.
    """

    logs: tuple[LogCheck, ...]
    seals: tuple[SealCheck, ...]
    others: tuple[Finding, ...] = ()
    strict: bool = False
    json_names: ClassVar = "logs seals faults"
    json_keys: ClassVar = {"faults": "findings"}

    @property
    def findings(self) -> tuple[Finding, ...]:
        """All that does not fit, in the order of the files."""
        in_logs = (finding for log in self.logs for finding in log.findings)
        return (*in_logs, *(finding for seal in self.seals for finding in seal.findings), *self.others)

    @property
    def faults(self) -> list[dict[str, Any]]:
        """The findings, each with its file, line, message and remedy."""
        return [_finding_json(finding) for finding in self.findings]

    @property
    def weak(self) -> tuple[LogCheck, ...]:
        """The logs that are unchained, if that counts as wrong."""
        return tuple(log for log in self.logs if self.strict and log.chained_from != 1)

    @property
    def exit_status(self) -> int:
        """1 if anything does not fit."""
        return int(bool(self.findings or self.weak))

    def apart(self, as_json: bool) -> Iterator[str]:
        """Yield a line for all that does not fit, but for what the JSON has."""
        yield from (f"error: {finding}" for finding in (() if as_json else self.findings))
        yield from (f"error: {visible(str(log.file))}: this log is {log.checksums}" for log in self.weak)

    def told(self) -> Iterator[str]:
        """Yield a line for each log and each seal; where all fits, what protects them."""
        for log in self.logs:
            copy = f", copy: {visible(log.mirror)}" if log.mirror else ""
            lines = counted(log.lines, "line", "lines")
            yield f"{visible(str(log.file))}: {lines}, {log.checksums}, {log.ending}{copy}, digest {log.digest}"
        for seal in self.seals:
            words = counted(len(seal.findings), "difference", "differences") if seal.findings else "as sealed"
            file, utc = visible(str(seal.seal.file)), visible(seal.seal.content.sealed_utc)
            yield f"{file}: sealed {utc}, {words}, {seal.signature}, SHA-256 {seal.seal.digest}"
        if not self.findings:
            if chained := sum(log.chained_from is not None for log in self.logs):
                yield f"{counted(chained, 'log', 'logs')}: every checksum fits"
            yield from (f"note: {sentence}" for sentence in unprotected(log.chained_from for log in self.logs))


def _finding_json(finding: Finding) -> dict[str, Any]:
    return {
        "file": finding.file,
        "line": finding.line,
        "message": finding.message,
        "remedy": finding.remedy,
    }


@dataclass(slots=True)
class _Seen:
    """What is kept of the lines."""

    file: Path
    records: RecordReader | None
    mirror: str | None = None
    complete: bool = False
    findings: list[Finding] = field(default_factory=list)

    def take(self, number: int, line: Any) -> None:
        if number == 1 and isinstance(line, dict):
            presentation = line.get("presentation")
            stated = presentation.get("results_mirror") if isinstance(presentation, dict) else None
            self.mirror = stated if isinstance(stated, str) else None
        self.complete = isinstance(line, dict) and line.get("record") == "end"
        if self.records is not None:
            self.records.take(number, line)
            self.records.records.clear()  # however long the log is
            self.records.pooled.clear()

    def fits(self, number: int) -> None:
        """Take note that the checksum of the next line, ``number``, fits."""
        if self.records is not None:
            self.records.fits(number)

    def damaged(self, error: DamagedLineError) -> None:
        """Keep what is wrong; after a line that was changed, the records that follow it need not fit it."""
        if error.changed:
            self.records = None
        self.findings.append(refusal(error, self.file))


def copy_in_mirror(file: Path, mirror: Path) -> Path:
    """Return where the copy of a session's log lies in the folder ``mirror``: EXPERIMENT/sub-OBSERVER/ses-LABEL."""
    return mirror.joinpath(*file.absolute().parts[-_LAYOUT:])


def check_log(file: Path, mirror: Path | None = None, within: Iterable[Path] = ()) -> LogCheck:
    """Check each line of a log: its checksum, and whether it is a record.

    Parameters
    ----------
    file
        The log of a session, or of a measurement.
    mirror
        Folder of the copies; None for the one that the session's header names, if it is there and ``within``.
    within
        Folders outside of which nothing is looked at that the header names: whoever wrote the log wrote that name.

    Returns
    -------
    LogCheck
        With a finding for each line that does not fit.

    Raises
    ------
    ResultsError
        If the file cannot be read.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from documents.files import DurableLog
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "session.jsonl")
    ...     with DurableLog.create(file, Path(folder, ".lock"), {"record": "session"}) as log:
    ...         log.append({"record": "trial", "trial": 0})
    ...     _ = file.write_bytes(file.read_bytes().replace(b'"trial":0', b'"trial":1'))
    ...     check = check_log(file)
    >>> check.checksums, check.lines, [finding.line for finding in check.findings]
    ('chained', 2, [1, 2])
    """
    measured = is_measurement_log(file)
    seen = _Seen(file, None if measured else RecordReader())
    try:
        with open_regular(file, "log", limit_bytes=MOST_LOG_BYTES, error=ResultsError) as stream:
            state = read_lines(stream, seen.take, seen.damaged, seen.fits)
    except OSError as error:
        raise ResultsError(unreadable(error, file, "results")) from error
    except DamagedLineError as error:
        raise ResultsError(refusal(error, file)) from error
    if not state.lines:
        seen.findings.append(Finding("the file has no session header", str(file), 1, 1, RESTORE))
    words = None if measured else _compare(file, state, seen, mirror, within)
    return LogCheck(
        file,
        "measurement" if measured else "session",
        state.lines,
        state.chained_from,
        seen.complete,
        len(state.torn_tail),
        state.digest,
        tuple(seen.findings),
        words,
    )


def _compare(file: Path, state: LogState, seen: _Seen, mirror: Path | None, within: Iterable[Path]) -> str | None:
    folder = mirror or (Path(seen.mirror) if seen.mirror else None)
    if folder is None:
        return None
    copy = copy_in_mirror(file, folder)
    if mirror is None and not any(_lies_in(place, copy) for place in within):
        return f"not looked at: {folder} is outside of what is checked, to compare give --mirror"
    if mirror is None and not folder.is_dir():
        return f"not compared: there is no folder {folder}"
    try:
        check = compare_copy(file, copy, state.size)
    except OSError as error:
        seen.findings.append(unreadable(error, copy, "copy"))
        return "cannot be read"
    if check.differs_at is not None:
        what = f"the copy of {file} differs at line {check.differs_at}"
        seen.findings.append(Finding(what, str(copy), check.differs_at, 1, "keep the one whose checksums fit"))
    elif check.behind:
        words = "is missing" if not check.size else f"is {check}"
        what = f"the copy of {file} {words}"
        seen.findings.append(Finding(what, str(copy), remedy="resume the session, or copy the file"))
    return str(check) if copy.exists() else "missing"


def _lies_in(folder: Path, file: Path) -> bool:
    """Return whether ``file`` lies in ``folder``; what is outside by its name is not touched to follow links."""
    places = (os.path.abspath(folder), os.path.realpath(folder))
    return any(Path(os.path.abspath(file)).is_relative_to(place) for place in places) and stays_in(folder, file)


def check_results(
    *places: Annotated[str | Path, Typed(metavar="RESULTS...")],
    mirror: str | Path | None = None,
    strict: bool = False,
    key: str | Path | None = None,
) -> ResultsCheck:
    """Check that results are as they were recorded.

    RESULTS are folders of sessions and measurements, from one station or many, or single logs. Each line's checksum is
    computed again, each copy compared with its log, and each folder that was sealed with its seal. Every line that does
    not fit is named, and the exit status is then 1. Logs of older versions are unchained: nothing protects them.

    Parameters
    ----------
    places
        Folders of results, from one station or many, or single logs.
    mirror
        Folder of the copies. Default: the one that the rig of a session named, if it lies in RESULTS.
    strict
        Exit status 1 also for a log that is unchained, from its first line or at all.
    key
        Public key of who sealed the results: a seal that it signed must name each log.

    Returns
    -------
    ResultsCheck
        A check for each log and seal.

    Raises
    ------
    ResultsError
        If a place, the mirror or the key does not exist, or a place is no log and holds none.

    Examples
    --------
    >>> check_results("experiments")
    Traceback (most recent call last):
    ...
    analysis.errors.ResultsError: experiments: the folder holds no session.jsonl (name a folder of results)
    """
    if mirror is not None and not Path(mirror).is_dir():
        remedy = looked_for(Path(mirror))
        raise ResultsError(Finding("there is no such folder of copies", str(mirror), remedy=remedy))
    measured = {Path(place): list(_measurements(Path(place))) for place in places}
    sessions = result_files(place for place in places if not measured[Path(place)] or _has_session(Path(place)))
    files = dict.fromkeys([*sessions, *(file for files in measured.values() for file in files)])
    for file in files:
        if file in map(Path, places) and not _is_log(file):
            what = "this is no log of a session or a measurement"
            raise ResultsError(Finding(what, str(file), remedy="name a folder of results, or a log"))
    signer = None if key is None else read_key(Path(key))
    within = [Path(place) for place in places]
    logs: list[LogCheck] = []
    seals: list[SealCheck] = []
    others: list[Finding] = []
    for file in files:
        try:
            logs.append(check_log(file, Path(mirror) if mirror else None, within))
        except ResultsError as error:
            others += error.findings
    for folder in dict.fromkeys(seal.parent for place in places for seal in _seals(Path(place))):
        try:
            seals.append(check_seal(folder, signer))
        except ResultsError as error:
            others += error.findings
    if signer is not None:
        others += _unsigned(files, seals, signer)
    return ResultsCheck(tuple(logs), tuple(seals), tuple(others), strict)


def _unsigned(files: Iterable[Path], seals: Iterable[SealCheck], key: Key) -> Iterator[Finding]:
    """Yield a finding for each log that no seal names which is signed by ``key``."""
    signed = {
        (check.seal.file.parent / name).absolute()
        for check in seals
        if check.signed_by is not None
        for name in check.seal.content.files
    }
    for file in files:
        if file.absolute() not in signed:
            what = f"no seal that is signed by the key {key.name} names this log"
            yield Finding(what, str(file), remedy="verify the folder that was sealed, as it was received")


def _is_log(file: Path) -> bool:
    """Return whether ``file`` may be a log: by its name, or by how it begins."""
    if file.name == FILE_NAME:
        return True
    with open_regular(file, "log", limit_bytes=MOST_LOG_BYTES, error=ResultsError) as stream:
        return b'"record"' in stream.read(_BEGINNING)


def _has_session(place: Path) -> bool:
    return place.is_dir() and next(place.rglob(FILE_NAME), None) is not None


def _seals(place: Path) -> Iterable[Path]:
    return sorted(place.rglob(SEAL)) if place.is_dir() else ()


def _measurements(place: Path) -> Iterator[Path]:
    files = sorted(place.rglob("*.jsonl")) if place.is_dir() else [place] if place.is_file() else []
    return (file for file in files if file.name != FILE_NAME and is_measurement_log(file))
