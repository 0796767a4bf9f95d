"""A serial line to an instrument: a command out, lines in, with an error of its own for every failure."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import TypeVar

import serial

from devices.readings.instrument import LostError, TimedOutError
from documents import Finding
from documents.platform import serial_errors

_LONGEST_LINE = 16384
_BETWEEN_CHARACTERS_S = 0.005
_GONE = serial_errors()
Done = TypeVar("Done")


class SerialLine:
    """The port ``port`` (``/dev/ttyACM0``, ``COM4``), 8 data bits, no parity, 1 stop bit.

    ``slowly`` sends a character at a time, for instruments that lose some if hurried.

    Raises
    ------
    LostError
        If the port cannot be opened.
    """

    def __init__(
        self, port: str, baud_rate: int, end: bytes, *, hardware_handshake: bool = False, slowly: bool = False
    ) -> None:
        self.port = port
        self._end = end
        self._slowly = slowly
        self._waiting = b""
        try:
            self._serial = serial.Serial(port, baud_rate, timeout=0.05, write_timeout=5.0, rtscts=hardware_handshake)
        except (OSError, ValueError) as error:
            remedy = f"is it plugged in and switched on? ports here: {', '.join(ports()) or 'none'}"
            why = getattr(error, "strerror", None) or str(error)
            raise LostError(Finding(f"the port cannot be opened: {why}", port, remedy=remedy)) from error

    def send(self, command: str) -> None:
        """Forget what came unasked, and send ``command``."""
        self._waiting = b""
        self._try(self._serial.reset_input_buffer)
        data = command.encode("ascii") + self._end
        for piece in [data[i : i + 1] for i in range(len(data))] if self._slowly else [data]:
            self._try(partial(self._serial.write, piece))
            self._try(self._serial.flush)
            if self._slowly:
                time.sleep(_BETWEEN_CHARACTERS_S)

    def line(self, within_s: float) -> str:
        """Return the next line that is not empty, without its end.

        Raises
        ------
        TimedOutError
            If there is none within ``within_s`` seconds.
        LostError
            If the line is gone.
        """
        until_s = time.monotonic() + within_s
        while True:
            line, end, rest = self._waiting.replace(b"\r", b"\n").partition(b"\n")
            if end:
                self._waiting = rest
                if line.strip():
                    return line.decode("ascii", "replace").strip()
                continue
            if time.monotonic() >= until_s:
                came = f", only '{line.decode('ascii', 'replace')[:40]}'" if line.strip() else ""
                raise TimedOutError(Finding(f"no answer came within {within_s:g} s{came}", self.port))
            if len(line) > _LONGEST_LINE:
                raise TimedOutError(Finding(f"a line of more than {_LONGEST_LINE} characters came", self.port))
            self._waiting += self._try(lambda: self._serial.read(max(1, self._serial.in_waiting)))

    def close(self) -> None:
        """Close the port."""
        with suppress(*_GONE):
            self._serial.close()

    def _try(self, act: Callable[[], Done]) -> Done:
        try:
            return act()
        except _GONE as error:
            remedy = "check the cable and the instrument, then go on with --resume"
            raise LostError(Finding(f"the instrument is gone: {error}", self.port, remedy=remedy)) from error


def ports() -> list[str]:
    """Return the names of this machine's serial ports."""
    from serial.tools.list_ports import comports

    return sorted(port.device for port in comports())
