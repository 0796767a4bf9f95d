"""Any instrument that ArgyllCMS knows, by its program `spotread` in a process of its own.

It runs once for the whole measurement with ``-e`` (emissive, absolute cd/m²), and gets an empty line for each reading.
ARGYLL_NOT_INTERACTIVE makes it take a line where it would take a key. Whatever goes wrong, it says so and prompts for
the next key: a prompt that comes without a result is a failed reading. Source: ArgyllCMS documentation [Argyll].
"""

from __future__ import annotations

import os
import queue
import re
import shlex
import subprocess
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress

from devices.readings import GarbledError, LostError, PatchOnScreen, RangeError, Reading, TimedOutError, Wiring
from documents import Finding

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_RESULT = re.compile(rf"Result is XYZ:\s*({_NUMBER})\s+({_NUMBER})\s+({_NUMBER})\s*[,\n]")
_READY = re.compile(r"key to take a reading")
_CALIBRATE = re.compile(r"any (?:other )?key to (?:continue|start)|hit any key to retry", re.IGNORECASE)
_RETRY = re.compile(r"any other key to retry")
# Readings that the instrument stored by itself are not of the patch that is shown.
_STORED = re.compile(r"any other key to use reading")
# Where a prompt begins; what stands before it is what the program says of the reading.
_PROMPT = re.compile(r"Place instrument on|Using the XY table|Correct position|Hit ESC or Q", re.IGNORECASE)
_RANGE = re.compile(r"too (?:bright|high|dark|low)|satur|over ?range", re.IGNORECASE)
_ENDING_S = 3.0


class Spotread:
    """`spotread` with ``options`` of its own (``-yl``, ``-X panel.ccss``) on its instrument number ``port``.

    ``ask`` shows a person what the instrument asks for and returns when it is done; None means that nobody is there.

    Raises
    ------
    LostError
        If the program is not installed or finds no instrument.
    """

    def __init__(
        self,
        port: str | None,
        options: Sequence[str],
        ask: Callable[[str], str | None],
        start_s: float = 60.0,
        measure_s: float = 300.0,
        program: str = "spotread",
    ) -> None:
        self._ask = ask
        self._measure_s = measure_s
        self._heard = ""
        command = [program, "-e", *(["-c", port] if port else []), *options]
        self.name = "ArgyllCMS " + " ".join(["spotread", *command[1:]])
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                env={**os.environ, "ARGYLL_NOT_INTERACTIVE": "1"},
            )
        except OSError as error:
            remedy = "install ArgyllCMS, and see that its programs are on the path"
            raise LostError(Finding(f"spotread cannot be run: {error.strerror}", program, remedy=remedy)) from error
        self._said: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._listen, name="spotread", daemon=True)
        self._reader.start()
        try:
            self._until_ready(start_s)
        except BaseException:
            self.close()
            raise

    @classmethod
    def opened(cls, wiring: Wiring) -> Spotread:
        """Return the instrument of the ``wiring``; its option ``spotread`` has the program's own, in one string."""
        options = shlex.split(wiring.own_options("spotread").get("spotread", ""))
        return cls(wiring.port, options, wiring.ask)

    def read(self, showing: PatchOnScreen) -> Reading:
        """Ask for a reading and return it."""
        self._until_ready(self._measure_s)
        self._send()
        until_s = time.monotonic() + self._measure_s
        while True:
            match = _RESULT.search(self._heard)
            if match:
                self._heard = self._heard[match.end() :]
                X, Y, Z = map(float, match.groups())
                return Reading((X, Y, Z))
            retry = _RETRY.search(self._heard)
            if retry or _READY.search(self._heard):
                why = self._said_of_the_reading()
                if retry:
                    self._send()
                raise (RangeError if _RANGE.search(why) else GarbledError)(f"spotread says: {why}")
            if _CALIBRATE.search(self._heard):
                self._until_ready(self._measure_s)
                self._send()
                until_s = time.monotonic() + self._measure_s
            self._hear(until_s)

    def close(self) -> None:
        """End the program."""
        with suppress(OSError, ValueError):
            if self._process.stdin:
                self._process.stdin.write(b"q\nq\n")
                self._process.stdin.close()
        try:
            self._process.wait(_ENDING_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join(_ENDING_S)
        if self._process.stdout and not self._reader.is_alive():
            self._process.stdout.close()

    def _until_ready(self, within_s: float) -> None:
        until_s = time.monotonic() + within_s
        while not _READY.search(self._heard):
            if _CALIBRATE.search(self._heard):
                self._calm()
                until_s = time.monotonic() + within_s
            elif _RETRY.search(self._heard):
                self._send()
            elif _STORED.search(self._heard):
                self._send(b"N\n")
            else:
                self._hear(until_s)

    def _calm(self) -> None:
        """Have a person do what the program waits for, and confirm it to the program."""
        words = " ".join(line.strip() for line in self._heard.splitlines()[-4:] if line.strip())
        if self._ask(f"spotread: {words} ") is None:
            raise LostError(Finding(f"spotread waits for a hand: {words}", remedy="run this at a terminal"))
        self._send()

    def _send(self, key: bytes = b" \n") -> None:
        """Send a key; the output before it no longer counts."""
        stream = self._process.stdin
        try:
            if stream is not None:
                stream.write(key)
                stream.flush()
        except (OSError, ValueError) as error:
            raise LostError(f"spotread has ended: {self._last_words()}") from error
        self._heard = ""

    def _hear(self, until_s: float) -> None:
        try:
            heard = self._said.get(timeout=max(0.0, until_s - time.monotonic()))
        except queue.Empty:
            raise TimedOutError(f"spotread did not answer in time; its last words: {self._last_words()}") from None
        if not heard:
            self._said.put(b"")
            remedy = "check the cable, then go on with --resume"
            raise LostError(Finding(f"spotread has ended: {self._last_words()}", remedy=remedy))
        self._heard += heard.decode("utf-8", "replace").replace("\r", "\n")

    def _listen(self) -> None:
        stream = self._process.stdout
        while stream is not None:
            heard = os.read(stream.fileno(), 4096)
            self._said.put(heard)
            if not heard:
                return

    def _said_of_the_reading(self) -> str:
        lines = [line.strip() for line in _PROMPT.split(self._heard)[0].splitlines() if line.strip()]
        return " ".join(lines)[-200:] or "nothing, and asks for the next reading"

    def _last_words(self) -> str:
        lines = [line.strip() for line in self._heard.splitlines() if line.strip()]
        return lines[-1][:120] if lines else "nothing"
