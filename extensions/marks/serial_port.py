"""Marks on a serial port.

pyserial opens the port; marks are written past it. Its ``write`` waits until the line is ready for more, and with a
short limit it reports bytes as lost that were sent, where the machine was busy meanwhile.
"""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from typing import Annotated, Literal

import serial
from pydantic import Field
from serial.tools.list_ports import comports

from documents import Finding
from documents.platform import pseudo_terminal, serial_errors, serial_writer
from extensions.marks.kind import Byte, Code, CodedMarks, Loopback, MarkError, MarkPort, PortLostError, PulseMs
from extensions.marks.pulse import Pulse

_GONE = serial_errors()


class SerialMarksSpec(CodedMarks):
    """Marks on a serial port: one byte each, 8 data bits, no parity, 1 stop bit."""

    kind: Literal["serial"]
    """A serial port, also one of an adapter or a trigger box at USB."""
    port: str = Field(min_length=1)
    """The port, such as /dev/ttyUSB0 or COM4."""
    baud: Annotated[int, Field(ge=50, le=4_000_000)] = 115_200
    """The speed of the line, in baud."""
    onset: Byte | None = 1
    """The byte at each onset, 1 to 255; null sends none."""
    answer: Byte | None = 2
    """The byte at each answer, 1 to 255; null sends none."""
    pulse_ms: PulseMs | None = None
    """Milliseconds after which the byte 0 follows each mark; null sends no 0."""
    trial_byte: bool = False
    """Whether a second byte follows each mark: how many trials were recorded before it, 0 to 255 and from 0 again."""

    @property
    def with_trial_byte(self) -> bool:
        """Whether the number of the trial follows each code."""
        return self.trial_byte

    def open_port(self) -> MarkPort:
        """Open the port."""
        return SerialPort(self)

    @contextmanager
    def loopback(self) -> Iterator[Loopback | None]:
        """Open a pseudo-terminal of this machine; None where it has none."""
        with pseudo_terminal() as terminal:
            if terminal is None:
                yield None
                return
            name, read = terminal
            with closing(SerialPort(self.model_copy(update={"port": name, "pulse_ms": None}))) as port:
                yield Loopback(port, "a pseudo-terminal", lambda within_s: bool(read(within_s)))


class SerialPort:
    """The port of ``spec``, which no other program may have open.

    Raises
    ------
    MarkError
        If it cannot be opened.
    """

    def __init__(self, spec: SerialMarksSpec) -> None:
        self._name = spec.port
        try:
            self._serial = serial.Serial(spec.port, spec.baud, write_timeout=0, exclusive=True)
        except _GONE as error:
            raise MarkError(_not_opened(spec.port, error)) from error
        self._write = serial_writer(self._serial)
        self._pulse = None if spec.pulse_ms is None else Pulse(self._write, spec.pulse_ms / 1000.0, bytes(1))

    is_heard = True  # nothing tells

    def send(self, code: Code, event_s: float, trial_byte: int | None = None) -> None:
        """Send the byte ``code``, and ``trial_byte`` behind it; nothing waits for the line."""
        word = bytes([int(code)] if trial_byte is None else [int(code), trial_byte])
        try:
            (self._pulse.send if self._pulse else self._write)(word)
        except BlockingIOError as error:
            raise MarkError(Finding("the port takes no more bytes: nothing reads them", self._name)) from error
        except _GONE as error:
            raise PortLostError(Finding(f"the port is gone: {error}", self._name)) from error

    def close(self) -> None:
        """Close the port."""
        if self._pulse:
            self._pulse.close()
        with suppress(*_GONE):
            self._serial.close()


def _not_opened(port: str, error: Exception) -> Finding:
    """Return why ``port`` cannot be opened and what to do, in words."""
    why = getattr(error, "strerror", None) or str(error)
    there = ", ".join(sorted(each.device for each in comports())) or "none"
    number = getattr(error, "errno", None)
    # The second is what pyserial says of a locked port, the third what Windows says of one that is open elsewhere.
    if number == errno.EBUSY or "lock port" in why or "PermissionError" in why:
        return Finding("the serial port is in use by another program", port, remedy="close that program")
    if number == errno.EACCES:
        remedy = "add yourself to the group that owns it, often: sudo usermod -aG dialout $USER, then log in again"
        return Finding("this user may not open the serial port", port, remedy=remedy)
    if number == errno.ENOENT or "FileNotFoundError" in why:
        return Finding("there is no such serial port", port, remedy=f"ports here: {there}")
    return Finding(f"the serial port cannot be opened: {why}", port, remedy=f"ports here: {there}")
