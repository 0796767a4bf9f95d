"""A loopback of a kind of port: what is sent comes back to this process, where that can be had without a wire."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass

from devices.timing_marks.lsl_stream import LslStream, lsl_library
from devices.timing_marks.port import MarkError, MarkPort
from devices.timing_marks.spec import LslMarksSpec, MarksSpec, SerialMarksSpec
from documents import Finding
from documents.platform import pseudo_terminal

_FOUND_WITHIN_S = 5.0
_SETTLED_WITHIN_S = 2.0


@dataclass(frozen=True, slots=True)
class Loopback:
    """An open ``port``, what it goes through (``by``), and ``receive``.

    ``receive`` waits for the next mark, for so many seconds at most, and returns whether it came.
    """

    port: MarkPort
    by: str
    receive: Callable[[float], bool]


@contextmanager
def open_loopback(spec: MarksSpec) -> Iterator[Loopback | None]:
    """Open a loopback of the kind of ``spec``, with its codes; None where none can be had.

    A serial port's is a pseudo-terminal of this machine, a stream's an inlet in this process; a parallel port has none.

    Parameters
    ----------
    spec
        An entry of a rig's ``timing_marks``; its own serial port is not opened.

    Yields
    ------
    Loopback or None
        What is closed when the ``with`` block ends.

    Raises
    ------
    MarkError
        If LSL is missing, or the stream does not come back.
    """
    if isinstance(spec, LslMarksSpec):
        with closing(LslStream(spec)) as port, _inlet(spec, port) as receive:
            yield Loopback(port, "an inlet in the same process", receive)
    elif isinstance(spec, SerialMarksSpec):
        with pseudo_terminal() as terminal:
            if terminal is None:
                yield None
                return
            from devices.timing_marks.serial_port import SerialPort

            name, read = terminal
            with closing(SerialPort(spec.model_copy(update={"port": name, "pulse_ms": None}))) as serial:
                yield Loopback(serial, "a pseudo-terminal", lambda within_s: bool(read(within_s)))
    else:
        yield None


@contextmanager
def _inlet(spec: LslMarksSpec, port: LslStream) -> Iterator[Callable[[float], bool]]:
    """Receive the stream of ``port``, and no other of that name on the network."""
    lsl = lsl_library()
    found = lsl.resolve_byprop("source_id", port.source, 1, _FOUND_WITHIN_S)
    if not found:
        raise MarkError(Finding("the stream is not found on the network of this machine", spec.stream))
    inlet = lsl.StreamInlet(found[0])
    try:
        inlet.open_stream(_FOUND_WITHIN_S)
        until_s = time.monotonic() + _SETTLED_WITHIN_S
        while inlet.pull_sample(0.05)[1] is None:  # samples that are sent before the connection stands are lost
            if time.monotonic() > until_s:
                raise MarkError(Finding("what is sent on the stream does not come back", spec.stream))
            port.send("loopback", time.monotonic())
        while inlet.pull_sample(0.1)[1] is not None:
            pass
        yield lambda within_s: inlet.pull_sample(within_s)[1] is not None
    finally:
        inlet.close_stream()
