"""How soon after the swap marks are sent and, where they come back, received."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass

from documents import Finding
from extensions.marks.kind import Marked, MarkError, MarkPort, MarksSpec

_MARKS = 200
_COMES_WITHIN_S = 1.0


@dataclass(frozen=True, slots=True)
class Delay:
    """How long after the swap something was, over many swaps: the median and the worst, in ms."""

    median_ms: float
    worst_ms: float

    @classmethod
    def of(cls, seconds: Sequence[float]) -> Delay:
        """Return the delay of several swaps, at least one."""
        return cls(round(1000.0 * statistics.median(seconds), 4), round(1000.0 * max(seconds), 4))


@dataclass(frozen=True, slots=True)
class MarkLatency:
    """How soon after the swap a rig's mark goes: ``sent`` on its port, and by a loopback of its kind.

    ``looped_sent`` and ``looped_received`` are of the loopback, which goes ``by`` an inlet or a pseudo-terminal.
    ``problem`` says what could not be measured, empty if all was.
    """

    name: str
    marks: int
    sent: Delay | None = None
    by: str = ""
    looped_sent: Delay | None = None
    looped_received: Delay | None = None
    problem: str = ""

    @property
    def sentences(self) -> tuple[str, ...]:
        """What was measured, in plain sentences."""
        found = []
        if self.sent:
            found.append(f"Marks on {self.name} were sent {_range(self.sent)} after the swap, of {self.marks}.")
        if self.looped_sent and self.looped_received:
            found.append(
                f"By {self.by}, marks of {self.name} were sent {_range(self.looped_sent)} and received "
                f"{_range(self.looped_received)} after the swap."
            )
        elif not self.by:
            found.append(f"Marks on {self.name} cannot be received here without a wire.")
        return (*found, f"Marks on {self.name}: {self.problem}.") if self.problem else tuple(found)


def _range(delay: Delay) -> str:
    return f"{delay.median_ms:.3f} ms (median) and at most {delay.worst_ms:.3f} ms"


def measure_marks(
    spec: MarksSpec, frame: Callable[[], object], placed: Callable[[Finding], Finding], marks: int = _MARKS
) -> MarkLatency:
    """Send ``marks`` marks to the port of ``spec``, each right after ``frame``, which draws and swaps.

    The port gets the code of onsets, as in a session. ``placed`` gives a fault its place in the rig file.
    """
    problems: list[Finding] = []
    sent = looped = received = None
    by = ""
    try:
        with closing(spec.open_port()) as port:
            sent, _ = _delays(spec, port, frame, marks)
    except MarkError as error:
        problems.append(placed(error.findings[0]))
    try:
        with spec.loopback() as loopback:
            if loopback:
                by = loopback.by
                looped, received = _delays(spec, loopback.port, frame, marks, loopback.receive)
    except MarkError as error:
        problems.append(placed(error.findings[0]))
    words = "; ".join(dict.fromkeys(map(str, problems)))
    return MarkLatency(spec.name, marks, sent, by, looped, received, words)


def _delays(
    spec: MarksSpec,
    port: MarkPort,
    frame: Callable[[], object],
    marks: int,
    receive: Callable[[float], bool] | None = None,
) -> tuple[Delay, Delay | None]:
    """Return how long after the swaps marks were sent and, where they come back, received.

    Raises
    ------
    MarkError
        If a mark was not sent, or did not come back.
    """
    marks_of = (spec.code(Marked("onset")), spec.code(Marked("answer")), 1)
    code = next(code for code in marks_of if code is not None)
    sent_s: list[float] = []
    received_s: list[float] = []
    for _ in range(marks):
        frame()
        swapped_s = time.monotonic()
        port.send(code, swapped_s)
        sent_s.append(time.monotonic() - swapped_s)
        if receive is not None:
            if not receive(_COMES_WITHIN_S):
                raise MarkError(Finding(f"a mark did not come back within {_COMES_WITHIN_S:g} s", spec.name))
            received_s.append(time.monotonic() - swapped_s)
    return Delay.of(sent_s), Delay.of(received_s) if received_s else None
