"""Marks on Lab Streaming Layer (LSL): one sample of text each, with the time of what it marks.

A stream of irregular rate and the type Markers is what recorders of LSL expect of a stimulus program
(labstreaminglayer.readthedocs.io). A sample's own time stamp is that of the onset or the answer, so that the mark is as
exact as that, however long the network takes.
"""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from types import ModuleType
from typing import Annotated, Literal

from pydantic import Field

from documents import Finding
from extensions.marks.kind import Code, Loopback, Marked, MarkError, MarkPort, MarksSpec

Words = Annotated[str, Field(min_length=1, max_length=100)]
_FOUND_WITHIN_S = 5.0
_SETTLED_WITHIN_S = 2.0


def lsl_library() -> ModuleType:
    """Return the package pylsl.

    Raises
    ------
    MarkError
        If it, or the library liblsl that it needs, is not installed.
    """
    try:
        import pylsl
    except ModuleNotFoundError as error:
        what, remedy = "marks on LSL need the package pylsl, which is not installed", "pip install '.[lsl]'"
        raise MarkError(Finding(what, remedy=remedy)) from error
    except (OSError, RuntimeError) as error:
        what = "the package pylsl is installed, and its library liblsl is not"
        remedy = "install liblsl from https://github.com/sccn/liblsl/releases, and name its file in PYLSL_LIB"
        raise MarkError(Finding(what, remedy=remedy)) from error
    library: ModuleType = pylsl
    return library


class LslStream:
    """The outlet of the stream ``name``; a recorder that listens to it finds it again when the session is resumed.

    Raises
    ------
    MarkError
        If the library is missing, or opens no stream.
    """

    def __init__(self, name: str) -> None:
        self._lsl = lsl_library()
        self._name = name
        self.source = f"{name}@{platform.node()}"  # by this a recorder finds it again
        try:
            info = self._lsl.StreamInfo(name, "Markers", 1, self._lsl.IRREGULAR_RATE, "string", self.source)
            self._outlet = self._lsl.StreamOutlet(info)
        except (OSError, RuntimeError, ValueError) as error:
            raise MarkError(Finding(f"LSL opens no stream: {error}", self._name)) from error

    @property
    def is_heard(self) -> bool:
        """Whether a recorder receives the stream now: what is sent before is lost to it."""
        return bool(self._outlet.have_consumers())

    def send(self, code: Code, event_s: float, trial_byte: int | None = None) -> None:
        """Send the text ``code``, stamped with the time of the event; the library's own threads do the rest."""
        try:
            stamp_s = event_s - time.monotonic() + self._lsl.local_clock()
            self._outlet.push_sample([str(code)], stamp_s)
        except (OSError, RuntimeError, ValueError) as error:
            raise MarkError(Finding(f"LSL does not take the mark: {error}", self._name)) from error

    def close(self) -> None:
        """End the stream."""
        del self._outlet


class LslMarksSpec(MarksSpec):
    """Marks on Lab Streaming Layer: a stream of text, of the type Markers."""

    place = "stream"
    kind: Literal["lsl"]
    """Lab Streaming Layer, with the package pylsl."""
    stream: Words = "cyclopean"
    """The name of the stream, by which a recorder finds it."""
    onset: Words | None = "onset"
    """The word for an onset in the text of each onset's mark; null sends none."""
    answer: Words | None = "answer"
    """The word for an answer in the text of each answer's mark; null sends none."""
    wait_s: Annotated[float, Field(ge=0, le=3600)] = 30.0
    """Seconds that a session waits, before its window opens, for a recorder that receives the stream."""

    def code(self, marked: Marked) -> Code | None:
        """Return the text of ``marked``, with this stream's word for the event; None if nothing is sent."""
        word = super().code(marked)
        return None if word is None else marked.text_as(str(word))

    @property
    def waits_s(self) -> float:
        """How many seconds a session waits for a recorder."""
        return self.wait_s

    def open_port(self) -> MarkPort:
        """Open the stream."""
        return LslStream(self.stream)

    @contextmanager
    def loopback(self) -> Iterator[Loopback]:
        """Open the stream, with an inlet in this process."""
        with closing(LslStream(self.stream)) as port, _inlet(self.stream, port) as receive:
            yield Loopback(port, "an inlet in the same process", receive)


@contextmanager
def _inlet(stream: str, port: LslStream) -> Iterator[Callable[[float], bool]]:
    """Receive the stream of ``port``, and no other of that name on the network."""
    lsl = lsl_library()
    found = lsl.resolve_byprop("source_id", port.source, 1, _FOUND_WITHIN_S)
    if not found:
        raise MarkError(Finding("the stream is not found on the network of this machine", stream))
    inlet = lsl.StreamInlet(found[0])
    try:
        inlet.open_stream(_FOUND_WITHIN_S)
        until_s = time.monotonic() + _SETTLED_WITHIN_S
        while inlet.pull_sample(0.05)[1] is None:  # samples that are sent before the connection stands are lost
            if time.monotonic() > until_s:
                raise MarkError(Finding("what is sent on the stream does not come back", stream))
            port.send("loopback", time.monotonic())
        while inlet.pull_sample(0.1)[1] is not None:
            pass
        yield lambda within_s: inlet.pull_sample(within_s)[1] is not None
    finally:
        inlet.close_stream()
