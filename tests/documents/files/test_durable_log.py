"""A log whose process is killed or whose disk is full: nothing that was written is dropped silently."""

from __future__ import annotations

import errno
import json
import os
import threading
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from documents.files import DamagedLineError, DurableLog, LogInUseError, LogState, read_lines


@dataclass(frozen=True)
class Content:
    lines: list[dict[str, object]]
    state: LogState


def read(file: Path) -> Content:
    lines: list[dict[str, object]] = []
    with open(file, "rb") as stream:
        return Content(lines, read_lines(stream, lambda number, line: lines.append(dict(line))))


def reopen(file: Path) -> tuple[DurableLog, Content]:
    return DurableLog.reopen(file, file.with_name(".lock"), file.with_name("torn.bin"), read)


def create(file: Path, lines: int) -> None:
    with DurableLog.create(file, file.with_name(".lock"), {"row": 0}) as log:
        for number in range(1, lines):
            log.append({"row": number, "text": "µ 'é' \u2028 \ud800"})


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000))
def test_a_log_cut_anywhere_loses_one_line_at_most_and_keeps_its_bytes(
    tmp_path_factory: pytest.TempPathFactory, cut: int
) -> None:
    file = tmp_path_factory.mktemp("log") / "a.jsonl"
    create(file, 4)
    whole = file.read_bytes()
    first = whole.index(b"\n") + 1
    size = first + cut % (len(whole) - first)
    os.truncate(file, size)
    log, content = reopen(file)
    with log:
        log.append({"row": "later"})
    torn = [path.read_bytes() for path in file.parent.glob("torn-*.bin")]
    assert torn == ([content.state.torn_tail] if content.state.torn_tail else [])
    kept = file.read_bytes()
    kept = kept[: kept.index(b'{"row":"later"')]
    assert (kept + content.state.torn_tail).removesuffix(b"\n") == whole[:size].removesuffix(b"\n")
    assert read(file).lines == [*content.lines, {"row": "later"}]


def test_lines_torn_twice_at_one_place_are_both_kept(tmp_path: Path) -> None:
    file = tmp_path / "a.jsonl"
    create(file, 2)
    for tail in (b'{"first', b'{"second', b'{"second'):
        with open(file, "ab") as stream:
            stream.write(tail)
        reopen(file)[0].close()
    assert sorted(path.read_bytes() for path in tmp_path.glob("torn-*.bin")) == [b'{"first', b'{"second']


def test_damage_before_the_last_line_is_named_and_nothing_is_cut(tmp_path: Path) -> None:
    file = tmp_path / "a.jsonl"
    create(file, 3)
    file.write_bytes(file.read_bytes().replace(b'"row":1', b'"row"1') + b'{"torn')
    before = file.read_bytes()
    with pytest.raises(DamagedLineError) as caught:
        reopen(file)
    assert caught.value.number == 2
    assert file.read_bytes() == before
    create_again = DurableLog.create(tmp_path / "b.jsonl", tmp_path / ".lock", {})  # the lock was let go
    create_again.close()


def test_a_torn_header_is_damage(tmp_path: Path) -> None:
    (tmp_path / "a.jsonl").write_bytes(b'{"row":')
    with pytest.raises(DamagedLineError):
        read(tmp_path / "a.jsonl")


def test_a_log_is_open_once(tmp_path: Path) -> None:
    file = tmp_path / "a.jsonl"
    with DurableLog.create(file, tmp_path / ".lock", {}), pytest.raises(LogInUseError):
        reopen(file)
    reopen(file)[0].close()


def test_threads_write_whole_lines(tmp_path: Path) -> None:
    file = tmp_path / "a.jsonl"
    with DurableLog.create(file, tmp_path / ".lock", {}) as log:

        def write(number: int) -> None:
            for _ in range(20):
                log.append({"by": number})

        threads = [threading.Thread(target=write, args=(number,)) for number in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert len(read(file).lines) == 81
    assert [json.loads(line) for line in file.read_bytes().splitlines()]


def test_a_header_that_cannot_be_written_leaves_no_log_and_no_lock(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(OSError, match="No space left"):
            create(tmp_path / "a.jsonl", 1)
    assert [path.name for path in tmp_path.iterdir() if path.name != ".lock"] == []
    create(tmp_path / "a.jsonl", 1)
