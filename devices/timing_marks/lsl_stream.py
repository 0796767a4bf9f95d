"""Marks on Lab Streaming Layer (LSL): one sample of text each, with the time of what it marks.

A stream of irregular rate and the type Markers is what recorders of LSL expect of a stimulus program
(labstreaminglayer.readthedocs.io). A sample's own time stamp is that of the onset or the answer, so that the mark is as
exact as that, however long the network takes.
"""

from __future__ import annotations

import platform
import time
from types import ModuleType

from devices.timing_marks.port import Code, MarkError
from devices.timing_marks.spec import LslMarksSpec
from documents import Finding


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
    """The outlet of ``spec``; a recorder that listens to it finds it again when the session is resumed.

    Raises
    ------
    MarkError
        If the library is missing, or opens no stream.
    """

    def __init__(self, spec: LslMarksSpec) -> None:
        self._lsl = lsl_library()
        self._name = spec.stream
        self.source = f"{spec.stream}@{platform.node()}"  # by this a recorder finds it again
        try:
            info = self._lsl.StreamInfo(spec.stream, "Markers", 1, self._lsl.IRREGULAR_RATE, "string", self.source)
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
