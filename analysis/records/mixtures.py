"""Sessions that can be looked at together: of one experiment, each once, all with the same stimuli."""

from __future__ import annotations

from collections.abc import Sequence

from analysis.errors import ResultsError
from analysis.records.session_record import SessionLog, Trial
from documents import Finding


def refuse_mixtures(sessions: Sequence[SessionLog]) -> None:
    """Do nothing if ``sessions`` belong together.

    Raises
    ------
    ResultsError
        If there is none, if they are of different experiments or show different stimuli, or if one stands there twice.
    """
    if not sessions:
        raise ResultsError(
            Finding("there is no session to read", remedy="name a folder that holds session.jsonl files")
        )
    reference = sessions[0]
    stimuli = {str(stimulus["name"]) for stimulus in reference.header.stimuli}
    seen: dict[tuple[str, str, str], SessionLog] = {}
    for session in sessions:
        header = session.header
        if header.experiment != reference.header.experiment:
            what = f"this session is of '{header.experiment}', {reference.file} of '{reference.header.experiment}'"
            folder = session.file.parent
            named = f": name its folder, such as {folder.parents[1]}" if folder.name.startswith("ses-") else ""
            remedy = f"look at one experiment at a time{named}"
            raise ResultsError(Finding(what, str(session.file), 1, 1, remedy))
        differing = stimuli ^ {str(stimulus["name"]) for stimulus in header.stimuli}
        if differing:
            what = f"this session and {reference.file} do not show the same stimuli: '{min(differing)}' is in one only"
            raise ResultsError(Finding(what, str(session.file), 1, 1, "look at them separately"))
        identity = (header.observer, header.session, header.started_utc)
        if identity in seen:
            what = f"this is the same session as {seen[identity].file}: its answers would count twice"
            raise ResultsError(Finding(what, str(session.file), 1, 1, "remove one of the copies"))
        seen[identity] = session


def damaged(session: SessionLog, trial: Trial, what: str) -> ResultsError:
    """Return the error that says ``what`` is wrong with one trial's record."""
    where = f"trial {trial.trial} of block {trial.block}"
    return ResultsError(Finding(f"the {where} {what}", str(session.file), remedy="restore the file"))
