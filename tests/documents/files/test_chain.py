"""A log in which a bit flipped, or a line was taken out, put in, exchanged or edited, is refused with the line."""

from __future__ import annotations

import hashlib
import io
import json
import os
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

from documents.files import DamagedLineError, DurableLog, LogState, read_lines, unprotected

TRIALS = 8
Row = dict[str, object]


@dataclass(frozen=True)
class Content:
    rows: list[Row]
    state: LogState


def read(file: Path) -> Content:
    rows: list[Row] = []
    with open(file, "rb") as stream:
        return Content(rows, read_lines(stream, lambda number, row: rows.append(row)))


def write(file: Path, *, by: str = "01", end: bool = True) -> list[bytes]:
    with DurableLog.create(file, file.with_name(".lock"), {"record": "session", "by": by}) as log:
        for number in range(TRIALS):
            log.append({"record": "trial", "trial": number, "chosen": "gloss é", "response_time_s": 1.25})
        if end:
            log.end({"record": "end", "work": {"draws": 3}})
    return file.read_bytes().splitlines(keepends=True)


def damaged(file: Path, lines: list[bytes]) -> DamagedLineError:
    file.write_bytes(b"".join(lines))
    with pytest.raises(DamagedLineError) as caught:
        read(file)
    assert caught.value.changed
    return caught.value


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.jsonl"


def test_each_line_ends_in_its_number_and_in_what_anyone_can_compute(file: Path) -> None:
    before = hashlib.sha256(b"").hexdigest()
    for number, line in enumerate(write(file), start=1):
        body, rest = line.split(b',"chain":')
        before = hashlib.sha256(before.encode() + body).hexdigest()
        assert rest == b'"%s"}\n' % before.encode()
        assert list(json.loads(line))[-2:] == ["line", "chain"]
        assert json.loads(line)["line"] == number
    assert json.loads(line)["lines"] == TRIALS + 1
    content = read(file)
    assert content.rows[-1] == {"record": "end", "work": {"draws": 3}}
    assert content.state == LogState(TRIALS + 2, file.stat().st_size, before, 1, b"", ended=True)


@pytest.mark.parametrize("end", [True, False])
def test_any_flipped_bit_is_named_with_its_line(file: Path, end: bool) -> None:
    lines = write(file, end=end)
    content = b"".join(lines)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line))
    for place in range(len(content)):
        changed = bytearray(content)
        changed[place] ^= 1 << place % 8
        number = next(n for n, start in enumerate(starts) if start > place)
        with pytest.raises(DamagedLineError) as caught:
            read_lines(io.BytesIO(changed), lambda number, row: None)
        assert caught.value.number == number, (place, content[place : place + 1], bytes(changed[place : place + 1]))


def edits(lines: list[bytes], other: list[bytes]) -> Iterator[tuple[str, list[bytes], int]]:
    last = len(lines)
    for at in range(last):
        yield "copied", [*lines[: at + 1], *lines[at:]], at + 2
        yield "put in from another log", [*lines[:at], other[at], *lines[at:]], 2 if at == 0 else at + 1
        if at < last - 1:  # what is cut off the end, nothing can notice
            yield "taken out", lines[:at] + lines[at + 1 :], at + 1
            yield "exchanged", [*lines[:at], lines[at + 1], lines[at], *lines[at + 2 :]], at + 1
        edited = {**json.loads(lines[at]), "response_time_s": 0.5}
        yield "written again", [*lines[:at], json.dumps(edited).encode() + b"\n", *lines[at + 1 :]], at + 1
        bare = {key: value for key, value in json.loads(lines[at]).items() if key not in ("line", "chain")}
        line = json.dumps(bare, separators=(",", ":")).encode() + b"\n"
        yield "without its checksum", [*lines[:at], line, *lines[at + 1 :]], at + 1
    yield "joined", [*lines, *other], last + 1
    yield "continued", [*lines, *other[1:]], last + 1
    yield "continued by a torn line", [*lines, other[1][:20]], last + 1


def test_every_edited_line_is_named(file: Path) -> None:
    lines, other = write(file), write(file.with_name("b.jsonl"), by="02")
    for what, changed, number in edits(lines, other):
        assert damaged(file, changed).number == number, what


def test_a_line_with_a_right_checksum_and_a_wrong_number_is_refused(file: Path) -> None:
    head, first, *rest = write(file)
    body = first.split(b',"chain":')[0].replace(b'"line":2', b'"line":3')
    chain = hashlib.sha256(json.loads(head)["chain"].encode() + body).hexdigest()
    line = body + b',"chain":"' + chain.encode() + b'"}\n'
    error = damaged(file, [head, line, *rest])
    assert error.number == 2
    assert "numbered 3" in str(error)


def test_a_log_whose_last_lines_were_cut_off_has_stopped(file: Path) -> None:
    lines = write(file)
    for kept in range(1, len(lines)):
        file.write_bytes(b"".join(lines[:kept]))
        content = read(file)
        assert not content.state.ended
        assert len(content.rows) == kept


def test_nothing_is_appended_after_the_end(file: Path) -> None:
    write(file)
    before = file.read_bytes()
    log, _ = DurableLog.reopen(file, file.with_name(".lock"), file.with_name("torn.bin"), read)
    with log, pytest.raises(ValueError, match="has its end line already"):
        log.append({"record": "note"})
    assert file.read_bytes() == before


def test_a_record_with_a_key_of_the_log_is_refused_and_nothing_written(file: Path) -> None:
    with DurableLog.create(file, file.with_name(".lock"), {"record": "session"}) as log:
        for key in ("line", "chain"):
            with pytest.raises(ValueError, match="which a log adds"):
                log.append({key: 1})
        log.append({"record": "trial"})
    assert read(file).state.lines == 2


def test_an_old_log_is_chained_from_where_it_was_resumed(file: Path) -> None:
    old = b'{"record":"session"}\n{"record":"trial","trial":0}\n'
    file.write_bytes(old + b'{"record":"trial","tri')
    log, content = DurableLog.reopen(file, file.with_name(".lock"), file.with_name("torn.bin"), read)
    assert content.state.chained_from is None
    with log:
        log.append({"record": "resume"})
        log.append({"record": "trial", "trial": 1})
        log.end({"record": "end"})
    whole = file.read_bytes()
    content = read(file)
    assert (content.state.chained_from, content.state.lines, content.state.ended) == (3, 5, True)
    resumed = whole[len(old) :].split(b',"chain":')[0]
    assert hashlib.sha256(hashlib.sha256(old).hexdigest().encode() + resumed).hexdigest().encode() in whole
    error = damaged(file, [whole.replace(b'"trial":0', b'"trial":4', 1)])
    assert (error.number, "1 to 2, which have no checksums" in str(error)) == (3, True)
    file.write_bytes(whole.replace(b"\n", b"\r\n"))  # as git or an editor on Windows writes it again
    assert read(file).rows == content.rows


@pytest.mark.parametrize(
    ("chained_from", "said"),
    [
        ((1, 1), []),
        ((2, 1), ["1 log was"]),
        ((None,), ["1 log is"]),
        ((None, None, 2, 9), ["2 logs are", "2 logs were"]),
    ],
)
def test_logs_that_a_chain_does_not_protect_are_counted(chained_from: Sequence[int | None], said: list[str]) -> None:
    assert [" ".join(one.split()[:3]) for one in unprotected(chained_from)] == said


def test_a_reading_that_goes_on_names_every_place(file: Path) -> None:
    rng = random.Random(18)
    for _ in range(30):
        lines = write(file)
        changed = sorted(rng.sample(range(len(lines)), 3))
        for at in changed:
            bits = bytearray(lines[at])
            bits[rng.randrange(len(bits) - 1)] ^= 1 << rng.randrange(8)
            lines[at] = bytes(bits)
        if any(line.count(b"\n") != 1 for line in lines):
            continue
        numbers: list[int] = []
        read_lines(lines, lambda number, row: None, lambda error: numbers.append(error.number))  # noqa: B023
        assert numbers == [at + 1 for at in changed]
    lines = write(file)
    lines = [*lines[:2], *lines[3:6], lines[7], lines[6], *lines[8:]]
    numbers = []
    read_lines(lines, lambda number, row: None, lambda error: numbers.append(error.number))
    assert numbers == [3, 6, 7, 9]  # one was taken out, two exchanged, and the end counts one more


def test_an_fsync_for_each_line_as_before(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []
    real = os.fsync

    def counted(descriptor: int) -> None:
        real(descriptor)
        synced.append(descriptor)

    with DurableLog.create(file, file.with_name(".lock"), {"record": "session"}) as log:
        monkeypatch.setattr(os, "fsync", counted)
        for number in range(TRIALS):
            log.append({"record": "trial", "trial": number})
        assert len(synced) == TRIALS
        log.end({"record": "end"})
    assert len(synced) == TRIALS + 1
