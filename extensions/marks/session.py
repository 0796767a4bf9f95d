"""Timing marks: what other machines are told of onsets and answers while a session runs, and what its record says.

A mark is sent by the session's own thread, with a write that never waits, right after the swap or the press. A port
that fails costs its marks and nothing else: the record says which, and the experimenter is told.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from devices.display import Rig
from documents import Finding
from documents.text import counted
from documents.yaml import read_yaml
from extensions.marks.kind import Marked, MarkError, MarkPort, MarksSpec, PortLostError
from extensions.marks.latency import MarkLatency, measure_marks
from runner.blocks import Factors, level_words
from runner.session import Answered, Event, Recording, SceneShown

_LOOKED_S = 0.05
_RECEIVED_WITHIN_S = 1.0
_UNHEARD = Finding(
    "nobody receives the stream, and no session waits for a recorder",
    remedy="write a wait_s above 0, or choose the stream in the recorder before the first page is left",
)
_NOBODY = "nobody receives the stream"


@dataclass(slots=True)
class OpenMarks:
    """A ``port``, as ``spec`` describes it, with what became of the marks that were to go there.

    ``failing`` says why the last mark was not sent, empty if it was; ``lost`` is how many were not since then,
    ``lost_in_all`` how many ever. Once it ``is_gone``, no mark will go through any more.
    """

    spec: MarksSpec
    port: MarkPort
    failing: str = ""
    lost: int = 0
    lost_in_all: int = 0
    is_gone: bool = False

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
        if self.is_gone:
            return self._failed(row)
        heard = self.port.is_heard  # before: a recorder that connects while it is sent may have missed it
        try:
            self.port.send(code, event_s, trial_byte)
            if not heard:
                self.failing = _NOBODY
                return self._failed(row)
        except MarkError as error:
            self.failing = error.findings[0].message
            self.is_gone = isinstance(error, PortLostError)
            return self._failed(row)
        sent_s = time.monotonic()
        self.failing = ""
        return row | {"sent_s": sent_s, "after_ms": round(1000.0 * (sent_s - event_s), 3)}

    def _failed(self, row: dict[str, Any]) -> dict[str, Any]:
        self.lost += 1
        self.lost_in_all += 1
        return row | {"failed": self.failing}


@dataclass(slots=True)
class TimingMarks:
    """Sends the marks of one session on the ports that are ``opened``, and states with each trial what was sent.

    ``since_start_s`` is the session's clock, which gives the seconds from the start that its header states, now.
    ``factors`` are the stimuli's. ``note`` is told which ports began to fail, and which work again.
    """

    opened: Sequence[OpenMarks]
    since_start_s: Callable[[], float]
    factors: Mapping[str, Factors]
    note: Callable[[str, str], None]
    _latest_onset_s: float = float("-inf")
    _told: set[str] = field(default_factory=set)
    _sent: dict[int, list[dict[str, Any]]] = field(default_factory=dict)  # since the last record, of each attempt

    def hear(self, event: Event) -> None:
        """Send the marks of onsets and answers; an onset is marked once, however often its scene is asked."""
        match event:
            case SceneShown(_, onset_s) if onset_s != self._latest_onset_s:
                self._latest_onset_s = onset_s
                self._send(event, onset_s)
            case Answered(_, time_s):
                self._send(event, time_s)
            case Recording(attempt, _, data):
                for sentence in self.news():
                    self.note(sentence, "program")
                if rows := self._sent.pop(attempt, None):
                    data["timing_marks"] = data.get("timing_marks", []) + rows

    def _send(self, event: SceneShown | Answered, event_s: float) -> None:
        shown = event.shown
        marked = Marked(
            "onset" if isinstance(event, SceneShown) else "answer",
            *(shown.block, shown.trial, shown.attempt),
            timed=shown.timed,
            stimuli=shown.stimuli,
            condition=self._condition(shown.stimuli),
        )
        sent = (marks.send(marked, event_s, shown.trials) for marks in self.opened)
        rows = [row for row in sent if row is not None]
        ahead_s = self._ahead_s() if rows else 0.0
        for row in rows:
            if "sent_s" in row:
                row["sent_s"] = round(row["sent_s"] + ahead_s, 6)
            if marked.event == "onset" and shown.timed:
                row["scene"] = shown.timed
        if rows:
            self._sent.setdefault(shown.attempt, []).extend(rows)

    def _condition(self, stimuli: Sequence[str]) -> dict[str, str]:
        """Return the levels that all of ``stimuli`` share, by factor, in the order of the first."""
        first, *others = [self.factors.get(name, {}) for name in stimuli] or [{}]
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
            since_start_s = self.since_start_s()
            after_s = time.monotonic()
            readings.append((after_s - before_s, since_start_s - (before_s + after_s) / 2.0))
        return min(readings)[1]

    def news(self) -> list[str]:
        """Return in sentences which ports began to fail, and which work again, since this was asked last."""
        sentences = []
        for marks in self.opened:
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


class SentMarks:
    """The ports of a rig's ``timing_marks``: opened before a session's window, closed after the last session."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._specs = [(place, spec) for place, spec in enumerate(rig.marks) if isinstance(spec, MarksSpec)]
        self.opened: list[OpenMarks] = []

    def described(self) -> list[str]:
        """Return where marks go, and the code of each event."""
        return [_words(spec) for _, spec in self._specs]

    def faults(self) -> Iterator[tuple[Finding, bool]]:
        """Open each port for a moment; yield why it cannot be, and as a doubt that nobody receives a stream.

        The latter is none where a session waits for a recorder.
        """
        for place, spec in self._specs:
            try:
                with closing(spec.open_port()) as port:
                    if not spec.waits_s and not wait_until_heard(port, _RECEIVED_WITHIN_S):
                        yield self._placed(place, _UNHEARD), True
            except MarkError as error:
                yield self._placed(place, error.findings[0]), False

    def measured(self, frame: Callable[[], object]) -> Iterator[MarkLatency]:
        """Send marks to each port, each right after ``frame``: the codes of onsets, as in a session."""
        for place, spec in self._specs:
            yield measure_marks(spec, frame, partial(self._placed, place))

    def prepare(self, notify: Callable[[str], None] = lambda sentence: None) -> None:
        """Open every port, and wait for those who receive its marks, as long as each entry says.

        ``notify`` is told what is waited for.

        Raises
        ------
        MarkError
            If one cannot be opened, with its place in the rig file.
        """
        for place, spec in self._specs:
            try:
                self.opened.append(OpenMarks(spec, spec.open_port()))
            except MarkError as error:
                raise MarkError(self._placed(place, error.findings[0])) from error
        for marks in self.opened:
            _wait_for_a_recorder(marks, notify)

    def remarks(self) -> Iterator[str]:
        """Yield in sentences which marks nobody receives now."""
        for marks in self.opened:
            if not marks.port.is_heard:
                name = marks.spec.name
                yield f"nobody receives the timing marks on {name}: what is sent before a recorder does is lost to it"

    @property
    def facts(self) -> list[dict[str, Any]]:
        """What a session's header states of each port."""
        return [marks.spec.facts for marks in self.opened]

    def listener(
        self,
        since_start_s: Callable[[], float],
        factors: Mapping[str, Factors],
        note: Callable[[str, str], None],
    ) -> TimingMarks:
        """Return what sends the marks of one session."""
        return TimingMarks(self.opened, since_start_s, factors, note)

    def lost(self) -> Iterator[str]:
        """Yield in sentences how many marks were not sent on each port, once a session is over."""
        for marks in self.opened:
            if marks.lost_in_all:
                were = counted(marks.lost_in_all, "timing mark was", "timing marks were")
                yield f"{were} not sent on {marks.spec.name}: each trial's record says which"

    def close(self) -> None:
        """Close the ports."""
        for marks in self.opened:
            marks.port.close()

    def _placed(self, place: int, fault: Finding) -> Finding:
        """Return what is wrong with an entry, with its place in the rig file."""
        spec, source = self._rig.marks[place], read_yaml(Path(self._rig.file))
        several = isinstance(source.data.get("timing_marks"), list)
        path = ("timing_marks", place, spec.place) if several else ("timing_marks", spec.place)
        return source.finding(path, f"{spec.name}: {fault.message}", fault.remedy)


def _words(spec: MarksSpec) -> str:
    codes = {event: getattr(spec, event) for event in ("onset", "answer")} | getattr(spec, "codes", {})
    told = [f"{what} = {code}" for what, code in codes.items() if code is not None]
    told += ["after each a byte with the trial's number"] if spec.with_trial_byte else []
    return f"{spec.name} ({', '.join(told)})"


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
