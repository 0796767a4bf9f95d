"""Timing marks: what other machines are told of onsets and answers while a session runs, and what its record says.

A mark is sent by the session's own thread, with a write that never waits, right after the swap or the press. A port
that fails costs its marks and nothing else: the record says which, and the experimenter is told.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from devices.display import Rig
from devices.timing_marks import Event, MarkError, MarkPort, MarksSpec, PortLostError, open_mark_port
from documents import Finding
from documents.text import counted
from documents.yaml import read_yaml


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

    def send(self, event: Event, event_s: float) -> dict[str, Any] | None:
        """Send the mark of ``event``, and return what is recorded of it; None where the event has none here.

        ``sent_s`` in it is on the clock of ``time.monotonic``, which `TimingMarks` makes the session's.
        """
        code = self.spec.code(event)
        if code is None:
            return None
        row: dict[str, Any] = {"port": self.spec.name, "mark": event, "code": code}
        if self._is_gone:
            return self._failed(row)
        try:
            self.port.send(code, event_s)
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


def open_marks(rig: Rig) -> tuple[OpenMarks, ...]:
    """Open every port of the rig's ``timing_marks``.

    Raises
    ------
    MarkError
        If one cannot be opened, with its place in the rig file; those before it are closed again.
    """
    opened: list[OpenMarks] = []
    try:
        for spec in rig.timing_marks:
            opened.append(OpenMarks(spec, open_mark_port(spec)))
    except MarkError as error:
        close_marks(opened)
        raise MarkError(placed(rig, len(opened), error)) from error
    return tuple(opened)


def placed(rig: Rig, index: int, error: MarkError) -> Finding:
    """Return what is wrong with an entry of the rig's ``timing_marks``, with its place in the rig file."""
    fault, spec = error.findings[0], rig.timing_marks[index]
    source = read_yaml(Path(rig.file))
    several = isinstance(source.data.get("timing_marks"), list)
    path = ("timing_marks", index, spec.place) if several else ("timing_marks", spec.place)
    return source.finding(path, f"{spec.name}: {fault.message}", fault.remedy)


def close_marks(opened: Sequence[OpenMarks]) -> None:
    """Close the ports."""
    for marks in opened:
        marks.port.close()


class TimingMarks:
    """The marks of one session, on the ports that are ``opened``; ``since_start_s`` is the session's clock.

    That gives the seconds from the start that the session's header states, now.
    """

    def __init__(self, opened: Sequence[OpenMarks] = (), since_start_s: Callable[[], float] = time.monotonic) -> None:
        self._opened = opened
        self._since_start_s = since_start_s
        self._latest_onset_s = float("-inf")
        self._told: set[str] = set()

    def onset(self, onset_s: float, timed_scene: str = "") -> list[dict[str, Any]]:
        """Send the marks of an onset, unless they were sent before, as where a scene stands already.

        ``timed_scene`` is the name of a scene that stands for a given time.
        """
        if onset_s == self._latest_onset_s:
            return []
        self._latest_onset_s = onset_s
        rows = self._send("onset", onset_s)
        return [row | {"scene": timed_scene} for row in rows] if timed_scene else rows

    def answer(self, pressed_s: float) -> list[dict[str, Any]]:
        """Send the marks of a press that answers."""
        return self._send("answer", pressed_s)

    def _send(self, event: Event, event_s: float) -> list[dict[str, Any]]:
        rows = [row for marks in self._opened if (row := marks.send(event, event_s)) is not None]
        if rows:
            ahead_s = self._ahead_s()
            for row in rows:
                if "sent_s" in row:
                    row["sent_s"] = round(row["sent_s"] + ahead_s, 6)
        return rows

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
