"""Timing marks: what other machines are told of onsets and answers while a session runs, and what its record says.

A mark is sent by the session's own thread, with a write that never waits, right after the swap or the press. A port
that fails costs its marks and nothing else: the record says which, and the experimenter is told.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from devices.display import Rig
from devices.timing_marks import Marked, MarkError, MarkPort, MarksSpec, PortLostError, open_mark_port
from documents import Finding
from documents.text import counted
from documents.yaml import read_yaml
from runner.blocks.context import Factors, level_words
from runner.session.events import Answered, Event, Recording, SceneShown, Shown

_LOOKED_S = 0.05
_NOBODY = "nobody receives the stream"


class OpenMarks:
    """A ``port``, as ``spec`` describes it, with what became of the marks that were to go there.

    ``failing`` says why the last mark was not sent, empty if it was; ``lost`` is how many were not since then,
    ``lost_in_all`` how many ever.
    """

    def __init__(self, spec: MarksSpec, port: MarkPort) -> None:
        self.spec = spec
        self.port = port
        self.failing = ""
        self.lost = 0
        self.lost_in_all = 0
        self._is_gone = False

    def send(self, marked: Marked, event_s: float, trials: int) -> dict[str, Any] | None:
        """Send the mark of ``marked``, and return what is recorded of it; None where there is none for it here.

        ``trials`` is how many were recorded before. ``sent_s`` in what is recorded is on the clock of
        ``time.monotonic``, which `TimingMarks` makes the session's.
        """
        code = self.spec.code(marked)
        if code is None:
            return None
        row: dict[str, Any] = {"port": self.spec.name, "mark": marked.event, "code": code}
        trial_byte = trials % 256 if self.spec.with_trial_byte else None
        if trial_byte is not None:
            row["trial_byte"] = trial_byte
        if self._is_gone:
            return self._failed(row)
        heard = self.port.is_heard  # before: a recorder that connects while it is sent may have missed it
        try:
            self.port.send(code, event_s, trial_byte)
            if not heard:
                self.failing = _NOBODY
                return self._failed(row)
        except MarkError as error:
            self.failing = error.findings[0].message
            self._is_gone = isinstance(error, PortLostError)
            return self._failed(row)
        sent_s = time.monotonic()
        self.failing = ""
        return row | {"sent_s": sent_s, "after_ms": round(1000.0 * (sent_s - event_s), 3)}

    def _failed(self, row: dict[str, Any]) -> dict[str, Any]:
        self.lost += 1
        self.lost_in_all += 1
        return row | {"failed": self.failing}

    @property
    def is_gone(self) -> bool:
        """Whether no mark will go through any more."""
        return self._is_gone


def open_marks(rig: Rig, notify: Callable[[str], None] = lambda sentence: None) -> tuple[OpenMarks, ...]:
    """Open every port of the rig's ``timing_marks``, and wait for those who receive them, as long as each entry says.

    ``notify`` is told what is waited for.

    Raises
    ------
    MarkError
        If one cannot be opened, with its place in the rig file; those before it are closed again.
    """
    opened: list[OpenMarks] = []
    try:
        for spec in rig.marks:
            opened.append(OpenMarks(spec, open_mark_port(spec)))
    except MarkError as error:
        close_marks(opened)
        raise MarkError(placed(rig, len(opened), error)) from error
    try:
        for marks in opened:
            _wait_for_a_recorder(marks, notify)
    except BaseException:
        close_marks(opened)
        raise
    return tuple(opened)


def wait_until_heard(port: MarkPort, seconds: float) -> bool:
    """Return whether someone receives what is sent on ``port``, after ``seconds`` at most."""
    until_s = time.monotonic() + seconds
    while not port.is_heard:
        if time.monotonic() >= until_s:
            return False
        time.sleep(_LOOKED_S)
    return True


def _wait_for_a_recorder(marks: OpenMarks, notify: Callable[[str], None]) -> None:
    if marks.port.is_heard or not marks.spec.waits_s:
        return
    notify(
        f"waiting at most {marks.spec.waits_s:g} s (wait_s) for a recorder of {marks.spec.name}: choose it there now"
    )
    wait_until_heard(marks.port, marks.spec.waits_s)


def unheard(opened: Sequence[OpenMarks]) -> tuple[str, ...]:
    """Return in sentences which marks nobody receives now."""
    return tuple(
        f"nobody receives the timing marks on {marks.spec.name}: what is sent before a recorder does is lost to it"
        for marks in opened
        if not marks.port.is_heard
    )


def placed(rig: Rig, index: int, error: MarkError) -> Finding:
    """Return what is wrong with an entry of the rig's ``timing_marks``, with its place in the rig file."""
    fault, spec = error.findings[0], rig.marks[index]
    source = read_yaml(Path(rig.file))
    several = isinstance(source.data.get("timing_marks"), list)
    path = ("timing_marks", index, spec.place) if several else ("timing_marks", spec.place)
    return source.finding(path, f"{spec.name}: {fault.message}", fault.remedy)


def close_marks(opened: Sequence[OpenMarks]) -> None:
    """Close the ports."""
    for marks in opened:
        marks.port.close()


class TimingMarks:
    """Sends the marks of one session on the ports that are ``opened``, and states with each trial what was sent.

    ``since_start_s`` is the session's clock, which gives the seconds from the start that its header states, now.
    ``factors`` are the stimuli's. ``note`` is told which ports began to fail, and which work again.
    """

    def __init__(
        self,
        opened: Sequence[OpenMarks] = (),
        since_start_s: Callable[[], float] = time.monotonic,
        factors: Mapping[str, Factors] | None = None,
        note: Callable[[str, str], None] = lambda words, by: None,
    ) -> None:
        self._opened = opened
        self._since_start_s = since_start_s
        self._factors = factors or {}
        self._note = note
        self._latest_onset_s = float("-inf")
        self._told: set[str] = set()
        self._sent: dict[int, list[dict[str, Any]]] = {}  # since the last record, of each attempt at a trial

    def hear(self, event: Event) -> None:
        """Send the marks of onsets and answers; an onset is marked once, however often its scene is asked."""
        match event:
            case SceneShown(shown, onset_s) if onset_s != self._latest_onset_s:
                self._latest_onset_s = onset_s
                self._send("onset", shown, onset_s)
            case Answered(shown, time_s):
                self._send("answer", shown, time_s)
            case Recording(attempt, _, data):
                for sentence in self.news():
                    self._note(sentence, "program")
                if rows := self._sent.pop(attempt, None):
                    data["timing_marks"] = rows

    def _send(self, event: Literal["onset", "answer"], shown: Shown, event_s: float) -> None:
        if not self._opened:
            return
        marked = Marked(
            event,
            *(shown.block, shown.trial, shown.attempt),
            timed=shown.timed,
            stimuli=shown.stimuli,
            condition=self._condition(shown.stimuli),
        )
        sent = (marks.send(marked, event_s, shown.trials) for marks in self._opened)
        rows = [row for row in sent if row is not None]
        ahead_s = self._ahead_s() if rows else 0.0
        for row in rows:
            if "sent_s" in row:
                row["sent_s"] = round(row["sent_s"] + ahead_s, 6)
            if event == "onset" and shown.timed:
                row["scene"] = shown.timed
        if rows:
            self._sent.setdefault(shown.attempt, []).extend(rows)

    def _condition(self, stimuli: Sequence[str]) -> dict[str, str]:
        """Return the levels that all of ``stimuli`` share, by factor, in the order of the first."""
        first, *others = [self._factors.get(name, {}) for name in stimuli] or [{}]
        return {
            factor: level_words(level)
            for factor, level in first.items()
            if all(other.get(factor) == level for other in others)
        }

    def _ahead_s(self) -> float:
        """Return how far the session's clock is ahead of ``time.monotonic``, by the least held up of three readings."""
        readings = []
        for _ in range(3):
            before_s = time.monotonic()
            since_start_s = self._since_start_s()
            after_s = time.monotonic()
            readings.append((after_s - before_s, since_start_s - (before_s + after_s) / 2.0))
        return min(readings)[1]

    def news(self) -> list[str]:
        """Return in sentences which ports began to fail, and which work again, since this was asked last."""
        sentences = []
        for marks in self._opened:
            name = marks.spec.name
            if marks.failing and name not in self._told:
                self._told.add(name)
                then = "none is sent there until the session is resumed" if marks.is_gone else "the next is tried"
                sentences.append(f"a timing mark was not sent on {name}: {marks.failing}; {then}")
            elif not marks.failing and marks.lost:
                self._told.discard(name)
                sentences.append(
                    f"timing marks are sent on {name} again, after {counted(marks.lost, 'was', 'were')} not"
                )
                marks.lost = 0
        return sentences


def lost_marks(opened: Sequence[OpenMarks]) -> list[str]:
    """Return in sentences how many marks were not sent on each port, once a session is over."""
    return [
        f"{counted(marks.lost_in_all, 'timing mark was', 'timing marks were')} not sent on {marks.spec.name}: each "
        "trial's record says which"
        for marks in opened
        if marks.lost_in_all
    ]
