"""The session logs to export, with their BIDS labels: letters and digits only, so that they are safe file names."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.errors import ResultsError
from analysis.records import (
    FILE_NAME,
    SessionLog,
    Sitting,
    WhoAnswered,
    by_folder,
    counts,
    notes_on_codes,
    read_session,
    result_files,
)
from documents import Finding, InputError
from documents.files import MOST_LOG_BYTES, read_regular

_LABEL = re.compile(r"[0-9A-Za-z]{1,64}")


def check_label(what: str, label: object, file: Path) -> str:
    """Return ``label`` if it is a BIDS label; ``what`` names it in the error.

    Raises
    ------
    ResultsError
        If it is not; ``file`` is named.
    """
    if not isinstance(label, str) or not _LABEL.fullmatch(label):
        raise ResultsError(
            Finding(
                f"the {what} {label!r} is not a BIDS label",
                str(file),
                1,
                1,
                "use up to 64 letters and digits in the file's header",
            )
        )
    return label


def task_label(experiment: object, file: Path) -> str:
    """Return the experiment's name as a task label: its letters and digits, as BIDS recommends.

    Raises
    ------
    ResultsError
        If nothing is left of the name; ``file`` is named.
    """
    label = re.sub(r"[^0-9A-Za-z]", "", experiment) if isinstance(experiment, str) else experiment
    return check_label("experiment", label or experiment, file)


Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, slots=True)
class Source:
    """A session to export: where its log is, its SHA-256, and its labels."""

    file: Path
    digest: str
    experiment: str
    task: str
    observer: str
    session: str
    simulated: bool
    complete: bool

    @property
    def name(self) -> str:
        """The prefix of the names of the session's files."""
        return f"sub-{self.observer}_ses-{self.session}_task-{self.task}"

    @property
    def folder(self) -> str:
        """The folder of the session's tables in the dataset."""
        return f"sub-{self.observer}/ses-{self.session}/beh"

    @property
    def raw(self) -> str:
        """The place of the session's log in the dataset, laid out as results are, so that commands can read it."""
        return f"sourcedata/{self.task}/sub-{self.observer}/ses-{self.session}/{FILE_NAME}"


@dataclass(frozen=True, slots=True)
class Sources:
    """The sessions, sorted by their names, and ``copies``: pairs of a file and its copy.

    ``doubts`` are sentences on observers' codes that may be of two people, or were changed.
    """

    sources: tuple[Source, ...]
    copies: tuple[tuple[Path, Path], ...]
    doubts: tuple[str, ...] = ()


def log_files(results: Sequence[Path], leave_out: Path) -> list[Path]:
    """Return each session log in ``results`` once, except those below ``leave_out`` and in hidden folders.

    Raises
    ------
    ResultsError
        With one finding for each of ``results`` that does not exist or holds no session.
    """
    return result_files(results, lambda file, place: _is_result(file, place, leave_out))


def _is_result(file: Path, place: Path, leave_out: Path) -> bool:
    hidden = any(part.startswith(".") for part in file.relative_to(place).parts)
    return not hidden and not file.resolve().is_relative_to(leave_out)


def without_simulated(files: Sequence[Path], *, with_simulated: bool) -> tuple[list[Path], int]:
    """Return the logs to export, and how many of simulated observers are left out beside those of people.

    A log whose header cannot be read stays, so that `find_sources` reports it.
    """
    if with_simulated:
        return [*files], 0
    simulated = [_is_simulated(file) for file in files]
    who = WhoAnswered.of(("", one) for one in simulated if one is not None)
    chosen = [file for file, one in zip(files, simulated, strict=True) if counts(who, simulated=bool(one))]
    return chosen, len(files) - len(chosen)


def _is_simulated(file: Path) -> bool | None:
    """Return what the header says; None if there is none that can be read."""
    try:
        header = json.loads(_content(file).partition(b"\n")[0])
    except (InputError, OSError, ValueError, RecursionError):
        return None
    simulated = header.get("simulated") if isinstance(header, dict) else None
    return simulated if isinstance(simulated, bool) else None


def find_sources(files: Iterable[Path], collect: Callable[[Source, SessionLog], None]) -> Sources:
    """Read each log and pass it to ``collect``, unless it is a copy of an earlier log.

    Raises
    ------
    ResultsError
        With a finding for every log that is damaged, has invalid labels, or has the labels of another log but other
        content; also where labels differ only in upper and lower case or two experiments would share a task label.
    """
    kept: dict[str, Source] = {}
    copies: list[tuple[Path, Path]] = []
    findings: list[Finding] = []
    experiments: dict[str, Source] = {}
    spellings: dict[str, Source] = {}
    digests: dict[str, Path] = {}
    sittings: list[Sitting] = []
    for file in files:
        try:
            digest = hashlib.sha256(_content(file)).hexdigest()
            log = by_folder(read_session(file))
            source = _source(log, digest)
        except InputError as error:
            findings += error.findings
            continue
        except RecursionError:
            findings.append(Finding("a record is nested too deeply to be read", str(file), remedy="restore the file"))
            continue
        if digest in digests:
            copies.append((digests[digest], file))
            continue
        digests[digest] = file
        if other := kept.get(source.name):
            findings.append(_conflict(other, source))
            continue
        fault = _same_task(experiments, source) or _same_spelling(spellings, source)
        if fault:
            findings.append(fault)
            continue
        kept[source.name] = source
        sittings.append(Sitting.of(log))
        try:
            collect(source, log)
        except InputError as error:
            findings += error.findings
    if findings:
        raise ResultsError(findings)
    return Sources(tuple(kept[name] for name in sorted(kept)), tuple(copies), tuple(notes_on_codes(sittings)))


def _content(file: Path) -> bytes:
    return read_regular(file, MOST_LOG_BYTES, "results", error=ResultsError)


def _source(log: SessionLog, digest: str) -> Source:
    header, file = log.header, log.file
    return Source(
        file,
        digest,
        header.experiment,
        task_label(header.experiment, file),
        check_label("observer", header.observer, file),
        check_label("session", header.session, file),
        bool(header.simulated),
        log.complete,
    )


def _conflict(first: Source, second: Source) -> Finding:
    content, other_content = _content(first.file), _content(second.file)
    longer = first.file if len(content) > len(other_content) else second.file
    if content.startswith(other_content) or other_content.startswith(content):
        remedy = f"one is the beginning of the other: remove the shorter file and keep {longer}"
    else:
        remedy = "check which of them is right, and remove the other"
    what = f"the session {first.session} of observer {first.observer} is in {first.file} with other content"
    return Finding(what, str(second.file), remedy=remedy)


def _same_task(experiments: dict[str, Source], source: Source) -> Finding | None:
    other = experiments.setdefault(source.task.casefold(), source)
    if other.experiment == source.experiment:
        return None
    what = (
        f"the experiments '{source.experiment}' and '{other.experiment}' ({other.file}) would share the task label "
        f"'{other.task}'"
    )
    return Finding(what, str(source.file), remedy="export them into folders of their own")


def _same_spelling(spellings: dict[str, Source], source: Source) -> Finding | None:
    for what, label in (("observer", source.observer), ("session", source.session)):
        other = spellings.setdefault(f"{what} {label}".casefold(), source)
        there = getattr(other, what)
        if there != label:
            text = f"the {what} '{label}' differs from '{there}' ({other.file}) only in upper and lower case"
            return Finding(text, str(source.file), remedy="export them into folders of their own: BIDS allows one only")
    return None
