"""What LibRaw reads of a raw file, in a process of its own that a damaged file cannot take this one down with."""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import subprocess
import sys
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from io import BufferedReader
from pathlib import Path
from typing import Any, NoReturn, cast

import numpy as np
from numpy.typing import NDArray

from documents.files import unreadable
from stimuli.develop.raw_process import MAX_PHOTOSITES
from stimuli.errors import StimulusError
from stimuli.pictures.picture_input import refuse_undecoded

# The process imports this checkout.
_ROOT = str(Path(__file__).resolve().parents[2])
_PROCESS = f"import sys; sys.path.insert(0, {_ROOT!r}); from stimuli.develop.raw_process import serve; serve()"
# The process itself is limited in processor time; this ends one that waits for a disk that does not answer.
_MOST_S = 300.0
_AGAIN = "copy it from the card again"


@dataclass(frozen=True, eq=False, slots=True)
class RawContent:
    """The codes of a sensor's visible part, and what LibRaw states of them.

    ``codes`` is uint16 (height, width), or (height, width, 3 or 4) of a ``stack`` of colours for each pixel.
    ``pattern`` is the colour filter's, ``filters`` that of the first 2 × 2 visible photosites; None without colours.
    ``whites``, ``blacks`` and ``balances`` are by colour; ``exposure`` is time in s, f-number and ISO, 0 if not known.
    """

    codes: NDArray[np.uint16]
    stack: bool
    pattern: Sequence[Sequence[int]] | None
    filters: Sequence[Sequence[int]] | None
    colours: int
    colour_names: str
    size_px: Sequence[int]
    flip: int
    white: int
    whites: list[float] | None
    blacks: list[float]
    balances: Sequence[Sequence[float] | None]
    exposure: Sequence[float]


def read_by_libraw(path: Path) -> RawContent:
    """Return what LibRaw reads of the raw file at ``path``.

    Raises
    ------
    StimulusError
        If it is damaged, of a kind that LibRaw does not know, or asks for more memory or time than a picture takes.
    """
    try:
        answer, codes = _processes.ask(path)
    except (OSError, MemoryError) as error:
        raise StimulusError(unreadable(error, path, "raw file")) from error
    if "wrong" in answer:
        _refuse(path, answer["wrong"], answer["detail"])
    if codes is None:
        message = "the raw file is damaged: LibRaw ended, or took more time than a picture of its size"
        refuse_undecoded(path, message, _AGAIN)
    content = RawContent(codes, **answer["facts"])
    width, height = content.size_px
    if codes.shape[:2] != (height, width) or min(codes.shape[:2]) < 2:
        what = f"the raw file has {codes.shape[1]} × {codes.shape[0]} photosites of {width} × {height}"
        raise StimulusError.at(path, what, "check it")
    return content


class _Processes:
    """The processes that LibRaw runs in: one for each thread that reads raw files, kept for the next file."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._idle: list[subprocess.Popen[bytes]] = []
        self._owner = 0

    def ask(self, path: Path) -> tuple[dict[str, Any], NDArray[np.uint16] | None]:
        """Return the answer on ``path`` and its codes, empty and None where the process ended without one."""
        answer, codes = self._ask(path)
        # One that was kept may have been ended since; what a file ends is a fork of it, and it says so.
        return (answer, codes) if answer else self._ask(path)

    def _ask(self, path: Path) -> tuple[dict[str, Any], NDArray[np.uint16] | None]:
        process = self._take()
        timer = threading.Timer(_MOST_S, process.kill)
        timer.start()
        kept = False
        try:
            answer, codes, kept = _asked(process, path)
            return answer, codes
        finally:
            timer.cancel()
            if kept:
                with self._lock:
                    self._idle.append(process)
            else:
                _end(process)

    def _take(self) -> subprocess.Popen[bytes]:
        with self._lock:
            if self._owner != os.getpid():  # of the process that this one was forked from
                self._idle, self._owner = [], os.getpid()
            while self._idle:
                process = self._idle.pop()
                if process.poll() is None:
                    return process
                _end(process)
        return subprocess.Popen(
            [sys.executable, "-c", _PROCESS],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )

    def close(self) -> None:
        """End the processes."""
        if self._owner == os.getpid():
            while self._idle:
                _end(self._idle.pop())


def _asked(process: subprocess.Popen[bytes], path: Path) -> tuple[dict[str, Any], NDArray[np.uint16] | None, bool]:
    """Return the answer, the codes, and whether the process can be asked again."""
    output = cast(BufferedReader, process.stdout)
    assert process.stdin is not None
    codes: NDArray[np.uint16] | None = None
    try:
        process.stdin.write(json.dumps(str(path.absolute())).encode() + b"\n")
        process.stdin.flush()
        answer: dict[str, Any] = json.loads(output.readline() or b"{}")
        if "facts" in answer:
            codes = np.empty(answer["shape"], np.dtype(answer["dtype"]))
            codes = codes if codes.size and output.readinto(codes.view(np.uint8).data) == codes.nbytes else None
        end = answer if "ended" in answer else json.loads(output.readline())
        whole = end["ended"] is not None
    except (BrokenPipeError, ValueError):  # it was ended, or what was written is not whole
        return {}, None, False
    return answer, codes, whole


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    # Closes its pipes and waits; what was not sent yet cannot be.
    with contextlib.suppress(BrokenPipeError), process:
        pass


_processes = _Processes()
atexit.register(_processes.close)


def _refuse(path: Path, kind: str, detail: str) -> NoReturn:
    message, remedy = {
        "unknown": ("this is no raw file that LibRaw knows", "give a raw file, TIFF or OpenEXR"),
        "damaged": ("the raw file is cut short or damaged", _AGAIN),
        "short": (f"the raw file is cut short or damaged: it has {detail}", _AGAIN),
        "large": (f"{detail} photosites are beyond {MAX_PHOTOSITES}", "crop it"),
        "memory": ("the raw file is damaged: it asks for more memory than a picture of its size", _AGAIN),
        "filter": (f"its colour filter is not known ({detail}), and is not Bayer", "export it as a linear TIFF"),
    }.get(kind, (f"the raw file cannot be read: {detail}", "convert it to DNG"))
    refuse_undecoded(path, message, remedy)
