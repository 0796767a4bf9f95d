"""A copy of a log that grows: whole whenever its folder is there, never waited for, never written over."""

from __future__ import annotations

import errno
import os
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from documents.files import CopyCheck, DurableLog, LogDisturbedError, Mirror, compare_copy
from documents.files import mirror as module

LINES = 30


@pytest.fixture(autouse=True)
def soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_AGAIN_S", 0.02)


class Lab:
    """A log with its mirror."""

    def __init__(self, folder: Path) -> None:
        self.file, self.root = folder / "a.jsonl", folder / "backup"
        self.copy = self.root / "deep" / "a.jsonl"
        self.root.mkdir()
        self.log = DurableLog.create(self.file, folder / ".lock", {"record": "session"})
        self.said: list[str] = []
        self.mirror = self.mirrored()

    def mirrored(self) -> Mirror:
        mirror = Mirror(self.log, self.copy, self.root, on_fault=self.said.append)
        mirror.follow(self.log.size)
        return mirror

    def write(self, lines: int = LINES) -> None:
        for number in range(lines):
            self.log.append({"record": "trial", "trial": number, "text": "é" * 50})
            self.mirror.follow(self.log.size)

    def until(self, met: Callable[[], object]) -> None:
        end = time.monotonic() + 20
        while not met():
            assert time.monotonic() < end
            time.sleep(0.01)

    @property
    def is_whole(self) -> bool:
        return self.copy.exists() and self.copy.read_bytes() == self.file.read_bytes()


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    lab = Lab(tmp_path)
    yield lab
    lab.mirror.close(5.0)
    lab.log.close()


def test_the_copy_is_whole_as_the_log_grows(lab: Lab) -> None:
    for _ in range(3):
        lab.write()
        lab.until(lambda: lab.is_whole)
    assert lab.mirror.close() is None
    assert lab.said == []
    assert str(compare_copy(lab.file, lab.copy)) == "whole"


def test_a_folder_that_vanishes_is_said_once_and_caught_up(lab: Lab) -> None:
    lab.write()
    lab.until(lambda: lab.is_whole)
    away = lab.root.rename(lab.root.with_name("away"))
    lab.write()
    lab.until(lambda: lab.said)
    lab.write()
    assert not lab.root.exists()  # nothing is written where a disk is not
    away.rename(lab.root)
    lab.write()
    lab.until(lambda: lab.is_whole)
    assert lab.mirror.close() is None
    assert len(lab.said) == 1
    assert "there is no such folder" in lab.said[0]


def test_a_full_disk_is_caught_up_when_there_is_room(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    real = open

    class Full:
        """A file that takes 20 bytes more."""

        def __init__(self, stream: Any) -> None:
            self._stream, self._room = stream, 20

        def __enter__(self) -> Full:
            return self

        def __exit__(self, *_: object) -> None:
            self._stream.close()

        def fileno(self) -> int:
            return int(self._stream.fileno())

        def write(self, data: memoryview) -> int:
            if not self._room:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            taken = min(self._room, len(data))
            self._room -= taken
            return int(self._stream.write(data[:taken]))

    def opened(file: Path, mode: str = "r", **more: Any) -> Any:
        stream = real(file, mode, **more)
        return Full(stream) if mode == "ab" else stream

    lab.until(lambda: lab.is_whole)
    with monkeypatch.context() as patch:
        patch.setattr(module, "open", opened, raising=False)
        lab.write()
        lab.until(lambda: lab.said)
    lab.until(lambda: lab.is_whole)
    assert len(lab.said) == 1
    assert "the disk is full (ENOSPC)" in lab.said[0]
    assert lab.mirror.close() is None


@pytest.mark.parametrize(
    ("change", "line"),
    [(lambda copy: copy.replace(b'"trial":2,', b'"trial":9,'), 4), (lambda copy: copy + b'{"a":1}\n', 5)],
)
def test_other_bytes_are_left_as_they_are(lab: Lab, change: Callable[[bytes], bytes], line: int) -> None:
    lab.write(3)
    assert lab.mirror.close() is None
    other = change(lab.copy.read_bytes())
    lab.copy.write_bytes(other)
    lab.mirror = lab.mirrored()
    lab.write(1)
    assert f"has another line {line}" in str(lab.mirror.close())
    assert lab.copy.read_bytes() == other
    assert len(lab.said) == 1


def test_a_copy_that_was_cut_within_a_line_goes_on_there(lab: Lab) -> None:
    lab.write()
    assert lab.mirror.close() is None
    for cut in (0, 1, 50, 777, lab.copy.stat().st_size - 1):
        os.truncate(lab.copy, cut)
        lab.mirror = lab.mirrored()
        assert lab.mirror.close() is None
        assert lab.is_whole


@pytest.mark.parametrize("harm", [lambda file: os.truncate(file, 9), Path.unlink, lambda file: file.write_bytes(b"no")])
def test_the_copy_is_whole_whatever_becomes_of_the_log(lab: Lab, harm: Callable[[Path], object]) -> None:
    lab.write()
    lab.until(lambda: lab.is_whole)
    harm(lab.file)
    with pytest.raises(LogDisturbedError):
        lab.write(1)
    lab.mirror.follow(lab.log.size)
    assert lab.mirror.close() is None
    assert lab.is_whole
    assert lab.copy.read_bytes().count(b"\n") == LINES + 2


def test_a_copy_changed_while_it_is_written_is_noticed_and_left_as_it_is(lab: Lab) -> None:
    lab.write()
    lab.until(lambda: lab.is_whole)
    other = lab.copy.read_bytes().replace(b'"trial":3,', b'"trial":9,')
    lab.copy.write_bytes(other)
    lab.write(1)
    assert "has another line 5" in str(lab.mirror.close())
    assert lab.copy.read_bytes() == other


@pytest.mark.nightly
def test_a_slow_copy_is_never_waited_for(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    go_on = threading.Event()

    def stuck(*_: object) -> None:
        go_on.wait(30)

    monkeypatch.setattr(Mirror, "_catch_up", stuck)
    began = time.perf_counter()
    for size in range(1000):
        lab.mirror.follow(size)
    assert time.perf_counter() - began < 2  # each of a copy's writes would take 30 s
    assert "is not complete yet" in str(lab.mirror.close(0.05))
    monkeypatch.undo()
    go_on.set()


def test_files_beside_are_copied_whole_and_once(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    lab.mirror.close()
    torn, twin = tmp_path / "torn-10.bin", lab.root / "deep" / "torn-10.bin"
    torn.write_bytes(b'{"rec')
    lab.mirror = Mirror(lab.log, lab.copy, lab.root, lambda: [(torn, twin)], lab.said.append)
    twin.parent.mkdir(exist_ok=True)
    twin.write_bytes(b'{"r')  # as where a disk was taken away meanwhile
    lab.write()
    assert lab.mirror.close() is None
    assert twin.read_bytes() == torn.read_bytes()
    twin.write_bytes(b"other")
    lab.mirror = Mirror(lab.log, lab.copy, lab.root, lambda: [(torn, twin)], lab.said.append)
    lab.write()
    lab.until(lambda: lab.is_whole)  # all the same
    assert "is another file than" in str(lab.mirror.close())
    assert twin.read_bytes() == b"other"
    lab.log.close()


def test_how_a_copy_compares(tmp_path: Path) -> None:
    file, copy = tmp_path / "a", tmp_path / "b"
    file.write_bytes(b"one\ntwo\nthree\n")
    assert compare_copy(file, copy) == CopyCheck(0, 3)
    for content, expected, words in [
        (b"", CopyCheck(0, 3), "behind by 3 lines"),
        (b"one\ntw", CopyCheck(6, 2), "behind by 2 lines"),
        (b"one\ntwo\nthree", CopyCheck(13, 1), "behind by 1 line"),
        (b"one\ntwo\nthree\n", CopyCheck(14, 0), "whole"),
        (b"one\ntWo\nthree\n", CopyCheck(5, 0, 2), "differs at line 2"),
        (b"one\ntwo\nthree\nfour", CopyCheck(14, 0, 4), "differs at line 4"),
    ]:
        copy.write_bytes(content)
        assert compare_copy(file, copy) == expected
        assert str(compare_copy(file, copy)) == words


def test_a_folder_that_stays_away_is_the_last_word(lab: Lab) -> None:
    lab.write()
    lab.until(lambda: lab.is_whole)
    lab.root.rename(lab.root.with_name("away"))
    lab.write()
    assert "there is no such folder" in str(lab.mirror.close())


def test_a_copy_in_a_new_folder_begins_at_the_first_line(lab: Lab) -> None:
    lab.write()
    lab.until(lambda: lab.is_whole)
    lab.root.rename(lab.root.with_name("away"))
    lab.root.mkdir()
    lab.write(1)
    lab.until(lambda: lab.is_whole)


def test_an_access_without_meaning_is_said_and_the_copy_goes_on_without_it(
    lab: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab.until(lambda: lab.is_whole)
    monkeypatch.setenv("CYCLOPEAN_ACCESS", "everyone")
    lab.write()
    lab.until(lambda: lab.said)
    assert "CYCLOPEAN_ACCESS" in lab.said[0]
    monkeypatch.delenv("CYCLOPEAN_ACCESS")
    lab.until(lambda: lab.is_whole)
    assert lab.mirror.close() is None
