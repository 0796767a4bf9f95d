"""A raw file that LibRaw cannot bear is refused, and neither this process nor the next file is touched by it."""

from __future__ import annotations

import os
import signal
import struct
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from stimuli.develop import libraw
from stimuli.develop.libraw import read_by_libraw
from stimuli.develop.raw_files import read_raw
from stimuli.errors import StimulusError
from tests.stimuli.develop.dng import save_dng, save_linear_dng

CODES = np.arange(24 * 32, dtype=np.uint16).reshape(24, 32) * 40


def patched(path: Path, tag: int, value: int, kind: int = 4) -> Path:
    """Write another value of a tag into the first directory of a little-endian TIFF file."""
    content = bytearray(path.read_bytes())
    (start,) = struct.unpack_from("<I", content, 4)
    for at in range(start + 2, start + 2 + 12 * struct.unpack_from("<H", content, start)[0], 12):
        if struct.unpack_from("<H", content, at)[0] == tag:
            struct.pack_into("<HII", content, at + 2, kind, 1, value)
    path.write_bytes(content)
    return path


def test_codes_and_facts_are_those_of_the_file(tmp_path: Path) -> None:
    content = read_by_libraw(save_dng(tmp_path / "a.dng", CODES, black=(600,), white=65000))
    np.testing.assert_array_equal(content.codes, CODES)
    assert (content.filters, content.white, content.stack) == ([[0, 1], [3, 2]], 65000, False)
    stack = read_by_libraw(save_linear_dng(tmp_path / "b.dng", np.dstack([CODES] * 3)))
    assert stack.stack
    np.testing.assert_array_equal(stack.codes[..., 1], CODES)


@pytest.mark.parametrize(
    ("width", "height", "compression", "message"),
    [
        (14_000, 14_000, 1, "cut short or damaged"),
        (14_000, 14_000, 7, "cut short or damaged"),
        (60_000, 60_000, 1, "photosites are beyond|cut short or damaged|cannot be read"),
        (2**31, 2**31, 7, "raw file"),
    ],
)
def test_what_a_header_asks_for_is_not_taken(
    tmp_path: Path, width: int, height: int, compression: int, message: str
) -> None:
    path = save_dng(tmp_path / "a.dng", CODES)
    for tag, value in ((256, width), (257, height), (278, height), (259, compression)):
        patched(path, tag, value)
    with pytest.raises(StimulusError, match=message):
        read_raw(path)


@pytest.mark.nightly
def test_a_process_that_was_killed_is_another_for_the_next_file(tmp_path: Path) -> None:
    path = save_dng(tmp_path / "a.dng", CODES)
    read_by_libraw(path)
    (idle, *_) = libraw._processes._idle
    os.kill(idle.pid, signal.SIGTERM if os.name == "nt" else signal.SIGKILL)
    np.testing.assert_array_equal(read_by_libraw(path).codes, CODES)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="each file has a process of its own")
def test_a_file_that_ends_its_process_is_refused_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fatal = "import os; from stimuli.develop import raw_process as p; main = p.main; "
    fatal += "p.main = lambda path: os.abort() if 'fatal' in path else main(path); "
    monkeypatch.setattr(libraw, "_PROCESS", libraw._PROCESS.replace("from stimuli", f"{fatal}from stimuli", 1))
    monkeypatch.setattr(libraw, "_processes", processes := libraw._Processes())
    good = save_dng(tmp_path / "a.dng", CODES)
    bad = save_dng(tmp_path / "fatal.dng", CODES)
    try:
        for _ in range(2):
            with pytest.raises(StimulusError, match=r"fatal\.dng: the raw file is damaged: LibRaw ended"):
                read_by_libraw(bad)
            np.testing.assert_array_equal(read_by_libraw(good).codes, CODES)
        assert len(processes._idle) == 1
    finally:
        processes.close()


def test_threads_read_side_by_side(tmp_path: Path) -> None:
    paths = [save_dng(tmp_path / f"{n}.dng", CODES + np.uint16(n)) for n in range(6)]
    with ThreadPoolExecutor(3) as pool:
        contents = list(pool.map(read_by_libraw, paths))
    for n, content in enumerate(contents):
        np.testing.assert_array_equal(content.codes, CODES + np.uint16(n))


def test_a_filter_that_is_not_known_is_refused(tmp_path: Path) -> None:
    path = save_dng(tmp_path / "a.dng", CODES, pattern=(3, 5, 1, 2))
    with pytest.raises(StimulusError, match=r"colour filter|raw file"):
        read_raw(path)
