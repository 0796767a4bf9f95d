"""Marks on the data pins of a parallel port, by the device ``/dev/parportN`` of Linux.

The kernel's own device asks for no library and no administrator, and lets one program have the port. Direct access to
the registers, which other systems need a driver for, is not offered.
"""

from __future__ import annotations

import errno
from functools import partial
from typing import Literal

from pydantic import Field

from documents import Finding
from documents.platform import close_parallel_port, open_parallel_port, set_parallel_pins
from extensions.marks.kind import Byte, Code, CodedMarks, MarkError, MarkPort, PortLostError, PulseMs
from extensions.marks.pulse import Pulse


class ParallelMarksSpec(CodedMarks):
    """Marks on the eight data pins of a parallel port of Linux."""

    kind: Literal["parallel"]
    """A parallel port of Linux."""
    port: str = Field(default="/dev/parport0", min_length=1)
    """The port, such as /dev/parport0."""
    onset: Byte | None = 1
    """The value of the pins at each onset, 1 to 255; null sends none."""
    answer: Byte | None = 2
    """The value of the pins at each answer, 1 to 255; null sends none."""
    pulse_ms: PulseMs = 5.0
    """Milliseconds after which the pins go back to 0."""

    def open_port(self) -> MarkPort:
        """Open the port."""
        return ParallelPort(self)


class ParallelPort:
    """The port of ``spec``, which no other program or driver may have.

    Raises
    ------
    MarkError
        If it cannot be opened.
    """

    def __init__(self, spec: ParallelMarksSpec) -> None:
        self._name = spec.port
        try:
            self._port = open_parallel_port(spec.port)
        except OSError as error:
            raise MarkError(_not_opened(spec.port, error)) from error
        self._pulse = Pulse(partial(set_parallel_pins, self._port), spec.pulse_ms / 1000.0, 0)

    is_heard = True  # nothing tells

    def send(self, code: Code, event_s: float, trial_byte: int | None = None) -> None:
        """Set the pins to ``code``, which stands for the pulse's time."""
        try:
            self._pulse.send(int(code))
        except OSError as error:
            raise PortLostError(Finding(f"the port is gone: {error}", self._name)) from error

    def close(self) -> None:
        """Close the port, with its pins at 0."""
        self._pulse.close()
        close_parallel_port(self._port)


def _not_opened(port: str, error: OSError) -> Finding:
    """Return why ``port`` cannot be opened and what to do, in words."""
    if error.errno == errno.ENOTSUP:
        what = "parallel ports can be used on Linux only"
        return Finding(what, port, remedy="use a serial port, or a trigger box at USB with kind: serial")
    if error.errno == errno.ENOENT:
        remedy = "load the driver: sudo modprobe parport_pc ppdev; without such a port, use kind: serial"
        return Finding("there is no such parallel port", port, remedy=remedy)
    if error.errno == errno.EACCES:
        remedy = "add yourself to the group that owns it, often: sudo usermod -aG lp $USER, then log in again"
        return Finding("this user may not open the parallel port", port, remedy=remedy)
    if error.errno in (errno.EBUSY, errno.ENXIO):
        remedy = "close that program; if it is the printer's driver: sudo modprobe -r lp"
        return Finding("the parallel port is in use by another program or driver", port, remedy=remedy)
    if error.errno in (errno.ENOTTY, errno.EINVAL):
        return Finding("this is no parallel port", port, remedy="name one such as /dev/parport0")
    return Finding(f"the parallel port cannot be opened: {error.strerror or error}", port)
