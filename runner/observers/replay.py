"""A recorded session played back: the same presses, the same time after each scene's onset."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from analysis.records.session_record import SessionLog, Trial, read_session, session_files
from documents import Finding
from runner.errors import SessionError
from runner.ports import Ask, KeyPress, WindowClosed
from runner.session.header import changes

Press = tuple[str, float]
Place = tuple[int, int]

_ASK_AGAIN: tuple[Press, ...] = (("escape", 0.0), ("r", 0.0))  # through the pause's menu


@dataclass(slots=True)
class Replay:
    """Presses what was pressed; the window counts as closed once a session that was never finished has no more."""

    presses: deque[Press]

    @classmethod
    def of(cls, log: SessionLog) -> Replay:
        """Return an observer who repeats what ``log`` holds."""
        script: list[Press] = []
        for answer, at_once in _in_order(log):
            script += [*(_ASK_AGAIN if at_once else ()), *answer.events]
        return cls(deque(script))

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        """Return the next press of the log."""
        if not self.presses:
            raise WindowClosed
        key, time_s = self.presses.popleft()
        if ask.meaning(key) is None and key != "escape":
            raise SessionError(f"the recorded session has the key '{key}' where only {sorted(ask.keys)} can be pressed")
        return KeyPress(key, onset_s + time_s)


def asked_after_their_block(log: SessionLog) -> tuple[Place, ...]:
    """Return the places of trials that were asked once more not at once but after their block."""
    return tuple(answer.place for answer, at_once in _in_order(log) if answer.attempt and not at_once)


def _in_order(log: SessionLog) -> list[tuple[Trial, bool]]:
    """Return the answers with whether each was asked once more at once, as the observer asked in the pause.

    Such an answer follows the one that it repeats.
    """
    marked_by: dict[Place, list[str]] = {}
    for mark in log.marks:
        marked_by.setdefault((mark.block, mark.trial), []).append(mark.by)
    answers = []
    before: Place | None = None
    for answer in log.answers:
        by = marked_by.get(answer.place, [])
        observers = 0 < answer.attempt <= len(by) and by[answer.attempt - 1] == "observer"
        answers.append((answer, observers and before == answer.place))
        before = answer.place
    return answers


def read_recording(path: Path) -> SessionLog:
    """Read the one session log that ``path`` is or holds.

    Raises
    ------
    InputError
        If there is none, or more than one.
    """
    files = list(session_files(path))
    if len(files) != 1:
        raise SessionError(Finding(f"there are {len(files)} sessions here", str(path), remedy="name one session.jsonl"))
    return read_session(files[0])


def check_replayable(
    log: SessionLog, experiment: str, observer: str, now: Mapping[str, str], *, accept_changes: bool = False
) -> tuple[str, ...]:
    """Return what a replay's record must say of it.

    Raises
    ------
    SessionError
        If the session was of another experiment or observer, or something changed since, unless that is accepted.
    """
    header = log.header
    if (header.experiment, header.observer) != (experiment, observer):
        what = f"the recorded session is of '{header.experiment}' and observer {header.observer}"
        remedy = f"replay it with the experiment '{header.experiment}' and --observer {header.observer}"
        raise SessionError(Finding(what, str(log.file), 1, 1, remedy))
    changed = changes(header, now)
    if changed and not accept_changes:
        what = f"the {' and the '.join(changed)} changed since the recorded session"
        remedy = "restore what it was made with, or replay it with --accept-changes"
        raise SessionError(Finding(what, str(log.file), 1, 1, remedy))
    remark = f"a replay of session {header.session}"
    return (remark + (f", although the {' and the '.join(changed)} changed" if changed else ""),)
