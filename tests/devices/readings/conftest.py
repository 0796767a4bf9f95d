"""An instrument at the far end of a pseudo-terminal, that answers as a transcript says."""

from __future__ import annotations

import os
import select
import threading
import tty
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import pytest

HANG_UP = b"<the cable is pulled>"
Answer = bytes | list[bytes] | Callable[[], bytes]


@dataclass
class Transcript:
    """Answers by command. A list is used up one by one, its last answer staying; ``HANG_UP`` pulls the cable."""

    answers: dict[str, Answer]
    end: bytes
    heard: list[str] = field(default_factory=list)
    port: str = ""
    _master: int = -1
    _slave: int = -1
    _thread: threading.Thread | None = None
    _over: bool = False

    def open(self) -> None:
        try:
            self._master, self._slave = os.openpty()
        except OSError as error:
            pytest.skip(f"this machine gives no pseudo-terminals (is /dev/pts mounted?): {error}")
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)
        self._thread = threading.Thread(target=self._play, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._over = True
        if self._thread:
            self._thread.join(5)
        self._hang_up()

    def _hang_up(self) -> None:
        for descriptor in (self._master, self._slave):
            if descriptor >= 0:
                os.close(descriptor)
        self._master = self._slave = -1

    def _play(self) -> None:
        waiting = b""
        while True:
            over = self._over  # what was written before that is still to be heard, after a moment on a busy machine
            ready, _, _ = select.select([self._master], [], [], 0.1 if over else 0.02)
            if not ready:
                if over:
                    return
                continue
            waiting += os.read(self._master, 4096)
            *commands, waiting = waiting.split(self.end)
            for command in commands:
                if not self._answer(command.decode()):
                    self._hang_up()
                    return

    def _answer(self, command: str) -> bool:
        self.heard.append(command)
        answer = self.answers.get(command, b"")
        if isinstance(answer, list):
            answer = answer.pop(0) if len(answer) > 1 else answer[0]
        data = answer() if callable(answer) else answer
        before, pulled, _ = data.partition(HANG_UP)
        os.write(self._master, before)
        return not pulled


@pytest.fixture
def play() -> Iterator[Callable[[dict[str, Answer], bytes], Transcript]]:
    """Play a transcript of (answers by command, what ends a command)."""
    playing: list[Transcript] = []

    def begin(answers: dict[str, Answer], end: bytes) -> Transcript:
        transcript = Transcript(dict(answers), end)
        transcript.open()
        playing.append(transcript)
        return transcript

    yield begin
    for transcript in playing:
        transcript.close()
