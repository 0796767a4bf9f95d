"""Results: reading the sessions in folders, and checking that sessions can be analysed together."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from analysis.errors import ResultsError
from analysis.kinds.trial import Trial
from analysis.records.codes import by_folder
from analysis.records.lines import SharedParts
from analysis.records.session_record import FILE_NAME, SessionLog, read_session, session_files
from documents import Finding
from documents.files import looked_for


def result_files(
    places: Iterable[str | Path], accept: Callable[[Path, Path], bool] = lambda file, place: True
) -> list[Path]:
    """Return the session logs in ``places``, each file once, in the order of ``places``.

    Parameters
    ----------
    places
        Folders of sessions, which are searched to any depth, or session logs.
    accept
        Called with each file and its place: whether to include the file.

    Raises
    ------
    ResultsError
        With one finding for each place that does not exist or holds no session.
    """
    files: dict[Path, Path] = {}
    findings: list[Finding] = []
    for place in map(Path, places):
        if not place.exists():
            findings.append(Finding("there is no such folder or file", str(place), remedy=looked_for(place)))
            continue
        inside = [file for file in session_files(place) if accept(file, place)]
        if not inside:
            findings.append(Finding(f"the folder holds no {FILE_NAME}", str(place), remedy="name a folder of results"))
        files |= {file.resolve(): file for file in inside}
    if findings:
        raise ResultsError(findings)
    return list(files.values())


def read_results(*places: str | Path) -> tuple[SessionLog, ...]:
    """Read every session in ``places``.

    Parameters
    ----------
    places
        Folders of sessions, from one station or many, or single session logs (``session.jsonl``).

    Returns
    -------
    One log for each session, complete or not, in the order of their paths. The observer's code is the one that a
    session's folder states, ``sub-CODE``, so that two people who had one code are parted by renaming a folder.

    Raises
    ------
    ResultsError
        If a place does not exist or holds no session, or a log is damaged.

    Examples
    --------
    >>> import tempfile
    >>> from analysis.records import read_results
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     read_results(folder)
    Traceback (most recent call last):
    ...
    analysis.errors.ResultsError: ...: the folder holds no session.jsonl (name a folder of results)
    """
    shared = SharedParts()
    with _no_search_for_cycles():
        return tuple(by_folder(read_session(file, shared)) for file in result_files(places))


@contextmanager
def _no_search_for_cycles() -> Iterator[None]:
    """Do not look for unreachable cycles: records have none, and a tenth of the time of reading went into it."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            if not gc.get_freeze_count():  # what was read counts as old from now on, and is not searched at once
                gc.freeze()
                gc.unfreeze()
            gc.enable()


def sessions_by_observer(sessions: Iterable[SessionLog]) -> dict[str, list[SessionLog]]:
    """Return the sessions of each observer, both in the given order."""
    by_observer: dict[str, list[SessionLog]] = {}
    for session in sessions:
        by_observer.setdefault(session.header.observer, []).append(session)
    return by_observer


def refuse_mixtures(sessions: Sequence[SessionLog]) -> None:
    """Check that ``sessions`` can be analysed together.

    Raises
    ------
    ResultsError
        If there are none, if experiments or stimuli differ, or if a session is there twice.
    """
    if not sessions:
        raise ResultsError(
            Finding("there is no session to read", remedy="name a folder that holds session.jsonl files")
        )
    reference = sessions[0]
    stimuli = set(reference.header.stimulus_names)
    seen: dict[tuple[str, str, str], SessionLog] = {}
    for session in sessions:
        header = session.header
        if header.experiment != reference.header.experiment:
            what = f"this session is of '{header.experiment}', {reference.file} of '{reference.header.experiment}'"
            folder = session.file.parent
            named = f": name its folder, such as {folder.parents[1]}" if folder.name.startswith("ses-") else ""
            remedy = f"report one experiment at a time{named}"
            raise ResultsError(Finding(what, str(session.file), 1, 1, remedy))
        differing = stimuli ^ set(header.stimulus_names)
        if differing:
            what = f"this session and {reference.file} do not show the same stimuli: '{min(differing)}' is in one only"
            raise ResultsError(Finding(what, str(session.file), 1, 1, "report them separately"))
        identity = (session.recorded_as or header.observer, header.session, header.started_utc)
        if identity in seen:
            what = f"this is the same session as {seen[identity].file}: its answers would count twice"
            raise ResultsError(Finding(what, str(session.file), 1, 1, "remove one of the copies"))
        seen[identity] = session


def damaged(session: SessionLog, trial: Trial, what: str) -> ResultsError:
    """Return the error for a trial whose record is damaged; ``what`` is wrong with it."""
    where = f"trial {trial.trial} of block {trial.block}"
    return ResultsError(Finding(f"the {where} {what}", str(session.file), remedy="restore the file"))
