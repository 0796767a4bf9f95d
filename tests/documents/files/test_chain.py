"""Logs: a chain that shows every change, lines that are read as JSON is, kills and full disks."""

from __future__ import annotations

import errno
import hashlib
import io
import json
import math
import os
import random
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from documents.files import (
    ChainReader,
    DamagedLineError,
    DurableLog,
    LogInUseError,
    LogState,
    Repeated,
    read_lines,
    unprotected,
)
from documents.files.chain import EMPTY, sealed
from documents.files.json_lines import parsed

# A log in which a bit flipped, or a line was taken out, put in, exchanged or edited, is refused with the line.

TRIALS = 8
Row = dict[str, object]


@dataclass(frozen=True)
class Content:
    rows: list[Row]
    state: LogState


def read(chain_file: Path) -> Content:
    rows: list[Row] = []
    with open(chain_file, "rb") as stream:
        return Content(rows, read_lines(stream, lambda number, row: rows.append(row)))


def write(chain_file: Path, *, by: str = "01", end: bool = True) -> list[bytes]:
    with DurableLog.create(chain_file, chain_file.with_name(".lock"), {"record": "session", "by": by}) as log:
        for number in range(TRIALS):
            log.append({"record": "trial", "trial": number, "chosen": "gloss é", "response_time_s": 1.25})
        if end:
            log.end({"record": "end", "work": {"draws": 3}})
    return chain_file.read_bytes().splitlines(keepends=True)


def damaged(chain_file: Path, lines: list[bytes]) -> DamagedLineError:
    chain_file.write_bytes(b"".join(lines))
    with pytest.raises(DamagedLineError) as caught:
        read(chain_file)
    assert caught.value.changed
    return caught.value


@pytest.fixture
def chain_file(tmp_path: Path) -> Path:
    return tmp_path / "a.jsonl"


def test_each_line_ends_in_its_number_and_in_what_anyone_can_compute(chain_file: Path) -> None:
    before = hashlib.sha256(b"").hexdigest()
    for number, line in enumerate(write(chain_file), start=1):
        body, rest = line.split(b',"chain":')
        before = hashlib.sha256(before.encode() + body).hexdigest()
        assert rest == b'"%s"}\n' % before.encode()
        assert list(json.loads(line))[-2:] == ["line", "chain"]
        assert json.loads(line)["line"] == number
    assert json.loads(line)["lines"] == TRIALS + 1
    content = read(chain_file)
    assert content.rows[-1] == {"record": "end", "work": {"draws": 3}}
    assert content.state == LogState(TRIALS + 2, chain_file.stat().st_size, before, 1, b"", ended=True)


@pytest.mark.parametrize("end", [True, False])
def test_any_flipped_bit_is_named_with_its_line(chain_file: Path, end: bool) -> None:
    lines = write(chain_file, end=end)
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


def test_every_edited_line_is_named(chain_file: Path) -> None:
    lines, other = write(chain_file), write(chain_file.with_name("b.jsonl"), by="02")
    for what, changed, number in edits(lines, other):
        assert damaged(chain_file, changed).number == number, what


def test_a_line_with_a_right_checksum_and_a_wrong_number_is_refused(chain_file: Path) -> None:
    head, first, *rest = write(chain_file)
    body = first.split(b',"chain":')[0].replace(b'"line":2', b'"line":3')
    chain = hashlib.sha256(json.loads(head)["chain"].encode() + body).hexdigest()
    line = body + b',"chain":"' + chain.encode() + b'"}\n'
    error = damaged(chain_file, [head, line, *rest])
    assert error.number == 2
    assert "numbered 3" in str(error)


def test_a_log_whose_last_lines_were_cut_off_has_stopped(chain_file: Path) -> None:
    lines = write(chain_file)
    for kept in range(1, len(lines)):
        chain_file.write_bytes(b"".join(lines[:kept]))
        content = read(chain_file)
        assert not content.state.ended
        assert len(content.rows) == kept


def test_nothing_is_appended_after_the_end(chain_file: Path) -> None:
    write(chain_file)
    before = chain_file.read_bytes()
    log, _ = DurableLog.reopen(chain_file, chain_file.with_name(".lock"), chain_file.with_name("torn.bin"), read)
    with log, pytest.raises(ValueError, match="has its end line already"):
        log.append({"record": "note"})
    assert chain_file.read_bytes() == before


def test_a_record_with_a_key_of_the_log_is_refused_and_nothing_written(chain_file: Path) -> None:
    with DurableLog.create(chain_file, chain_file.with_name(".lock"), {"record": "session"}) as log:
        for key in ("line", "chain"):
            with pytest.raises(ValueError, match="which a log adds"):
                log.append({key: 1})
        log.append({"record": "trial"})
    assert read(chain_file).state.lines == 2


def test_an_old_log_is_chained_from_where_it_was_resumed(chain_file: Path) -> None:
    old = b'{"record":"session"}\n{"record":"trial","trial":0}\n'
    chain_file.write_bytes(old + b'{"record":"trial","tri')
    log, content = DurableLog.reopen(chain_file, chain_file.with_name(".lock"), chain_file.with_name("torn.bin"), read)
    assert content.state.chained_from is None
    with log:
        log.append({"record": "resume"})
        log.append({"record": "trial", "trial": 1})
        log.end({"record": "end"})
    whole = chain_file.read_bytes()
    content = read(chain_file)
    assert (content.state.chained_from, content.state.lines, content.state.ended) == (3, 5, True)
    resumed = whole[len(old) :].split(b',"chain":')[0]
    assert hashlib.sha256(hashlib.sha256(old).hexdigest().encode() + resumed).hexdigest().encode() in whole
    error = damaged(chain_file, [whole.replace(b'"trial":0', b'"trial":4', 1)])
    assert (error.number, "1 to 2, which have no checksums" in str(error)) == (3, True)
    chain_file.write_bytes(whole.replace(b"\n", b"\r\n"))  # as git or an editor on Windows writes it again
    assert read(chain_file).rows == content.rows


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


def test_a_reading_that_goes_on_names_every_place(chain_file: Path) -> None:
    rng = random.Random(18)
    for _ in range(30):
        lines = write(chain_file)
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
    lines = write(chain_file)
    lines = [*lines[:2], *lines[3:6], lines[7], lines[6], *lines[8:]]
    numbers = []
    read_lines(lines, lambda number, row: None, lambda error: numbers.append(error.number))
    assert numbers == [3, 6, 7, 9]  # one was taken out, two exchanged, and the end counts one more


def test_an_fsync_for_each_line_as_before(chain_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []
    real = os.fsync

    def counted(descriptor: int) -> None:
        real(descriptor)
        synced.append(descriptor)

    with DurableLog.create(chain_file, chain_file.with_name(".lock"), {"record": "session"}) as log:
        monkeypatch.setattr(os, "fsync", counted)
        for number in range(TRIALS):
            log.append({"record": "trial", "trial": number})
        assert len(synced) == TRIALS
        log.end({"record": "end"})
    assert len(synced) == TRIALS + 1


# A log whose process is killed or whose disk is full: nothing that was written is dropped silently.
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
    assert read(file).rows == [*content.rows, {"row": "later"}]


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
        assert len(read(file).rows) == 81
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


# A line is read as `json.loads` reads it, and a checksum is looked at as closely as need be.

NUMBERS = st.floats() | st.integers() | st.integers(min_value=-(10**30), max_value=10**30)
VALUES = st.recursive(
    st.none() | st.booleans() | NUMBERS | st.text(st.characters(codec=None)),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4),
    max_leaves=12,
)
ODD = [
    *(b"", b" ", b"\xef\xbb\xbf{}", b"\xff", b'"\xed\xa0\x80"', b'"\\ud800"', b'"\\ud83d\\ude00"', b'{"a":1}\0'),
    *(b'{"a":1,"a":2}', b'{"a":1,}', b'{"a":01}', b'"\t"', b"1.", b".5", b"+1"),
    *(b"-0", b"-0.0", b"1e400", b"nan", b"NaN"),
    *(b"-Infinity", b"1_0", b"1" * 5000, b"[" * 250 + b"]" * 250, b"5e-324", b"9007199254740993.0"),
    *("{}".encode("utf-16"), b'{"a":1} x', b'{"a":1', b"[" * 100_000),
]


def json_lines_read(reader: Any, raw: bytes) -> object:
    """Return the value by its form (which tells -0.0, 1 and 1.0 apart), or the kind of error and its words."""
    try:
        return repr(reader(raw))
    except (ValueError, RecursionError) as error:
        return type(error), str(error)


@given(VALUES, st.booleans())
def test_a_value_is_read_as_by_json_loads(value: object, ascii_only: bool) -> None:
    raw = json.dumps(value, ensure_ascii=ascii_only).encode("utf-8", "surrogatepass")
    assert json_lines_read(parsed, raw) == json_lines_read(json.loads, raw)


@given(st.floats(allow_nan=False, allow_infinity=False), st.integers(min_value=1, max_value=40))
def test_a_number_of_any_length_is_the_same_float(number: float, digits: int) -> None:
    raw = f"{number:.{digits}e}".encode()
    assert math.copysign(1, parsed(raw)) == math.copysign(1, json.loads(raw))
    assert parsed(raw) == json.loads(raw)


@pytest.mark.parametrize("raw", ODD, ids=range(len(ODD)))
def test_what_is_odd_is_read_or_refused_as_by_json_loads(raw: bytes) -> None:
    assert json_lines_read(parsed, raw) == json_lines_read(json.loads, raw)


@given(st.lists(st.integers(0, 3), min_size=1, max_size=8), st.integers(0, 2**32))
def test_the_line_that_is_due_is_seen_as_by_a_closer_look(changes: list[int], place: int) -> None:
    chain, before = ChainReader(), EMPTY
    for number, change in enumerate(changes, start=1):
        line, before = sealed({"record": "trial", "trial": number} if number > 1 else {}, number, before)
        at = place % len(line)
        changed = {1: bytes([*line[:at], line[at] ^ 1, *line[at + 1 :]]), 2: line[:at], 3: b'{"a":1}'}
        raw = changed.get(change, line)
        link = chain.look(raw)
        assert link == chain._look_closely(raw)
        chain.take(link)


@pytest.mark.parametrize(
    ("further", "once"),
    [
        ({"costs": {"a": {"left": 1.5}}}, True),
        ({"comment": ',"costs":{"a":1', "costs": {"a": {}}}, True),
        ({"costs": {"a": {}}, "timed": [{"frames": 1}]}, False),
        ({"costs": {"a": {}}, "ratings": {"a": 1}}, False),
        ({"costs": {"b": 1, "costs": {"a": {}}}}, False),
        ({"costs": [], "further": {"b": 1, "costs": {"a": {}}}}, False),
        ({"costs": [], "further": [1, {"b": 1, "costs": {"a": {}}}]}, False),
    ],
)
def test_values_that_are_repeated_are_read_once(further: dict[str, Any], once: bool) -> None:
    records, raws, before = [{"record": "session"}, *[{"record": "trial", **further}] * 2], [], EMPTY
    for number, record in enumerate(records, start=1):
        raw, before = sealed(record, number, before)
        raws.append(raw + b"\n")
    lines: list[Any] = []
    read_lines(raws, lambda number, line: lines.append(line), repeated=Repeated(first="stimuli", last="costs"))
    assert [[*line.items()] for line in lines] == [[*record.items()] for record in records]
    assert (lines[1]["costs"] is lines[2]["costs"]) == once


@pytest.mark.parametrize(
    ("header", "once"),
    [
        ({"stimuli": [{"flat": True}], "hashes": {"display": "d", "stimuli": "s"}}, True),
        ({"comment": ',"stimuli":[', "stimuli": [], "chained": True}, True),
        ({"hashes": {"display": "d", "stimuli": []}, "further": []}, False),
    ],
)
def test_first_lines_that_are_alike_are_read_once(header: dict[str, Any], once: bool) -> None:
    repeated, lines = Repeated(first="stimuli", last="costs"), []
    records = [{"record": "session", "observer": observer, **header} for observer in ("a", "b")]
    for record in records:
        raw, _ = sealed(record, 1, EMPTY)
        read_lines([raw + b"\n"], lambda number, line: lines.append(line), repeated=repeated)
    assert [[*line.items()] for line in lines] == [
        [(key, value) for key, value in record.items() if key != "chained"] for record in records
    ]
    assert all((lines[0][key] is lines[1][key]) == once for key in header if isinstance(header[key], list | dict))


def test_an_end_line_counts_its_lines_whatever_it_ends_with() -> None:
    begin, before = sealed({"record": "session"}, 1, EMPTY)
    end, _ = sealed({"record": "end", "lines": 7, "costs": {"a": {}}}, 2, before)
    repeated = Repeated(first="stimuli", last="costs")
    with pytest.raises(DamagedLineError, match="another number of lines"):
        read_lines([begin + b"\n", end + b"\n"], lambda number, line: None, repeated=repeated)
