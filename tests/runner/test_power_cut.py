"""Whatever the last record was, a cut at any byte of it loses that record at most, and nothing before it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from analysis.errors import ResultsError
from analysis.records import FILE_NAME, Change, Mark, Note, Resumption, SessionLog, new_header, read_session
from runner.session import Recorder
from tests.answers import changed, new_answer

UTC = "2026-01-01T00:00:01.000+00:00"
HEADER = new_header("e", "01", "s", UTC, question="Which — µ?", simulated=True, stimuli=({"name": "a"}, {"name": "b"}))
NOTE = Note(text="dim lamp — ä \u2028 'quoted' \\ 日本", by="experimenter", block=0, trial=0, utc=UTC)
PAIR = {"first": "a", "second": "b"}
CHOSEN, OTHER = {"chosen": "a", "rejected": "b"}, {"chosen": "b", "rejected": "a"}
FIRST, SECOND = PAIR | {"answer": "first"} | CHOSEN, PAIR | {"answer": "second"} | OTHER
PRESSES = (("text é", 0.25), ("up", 1.25))
ANSWER = new_answer(0, 0, "all_pairs", PRESSES, 1.25, UTC, {**FIRST, "stamps": {"µ": 1}})
AGAIN = new_answer(0, 0, "all_pairs", (("down", 1.0),), 1.0, UTC, SECOND, attempt=1)
MARK = Mark(block=0, trial=0, by="observer", utc=UTC)
RESUMPTION = Resumption(utc=UTC, accepted_changes={"display": Change(before="0", now="1")})


def _attempts(recorder: Recorder, least: int) -> int:
    """Return how many first attempts the log has; of others than the first, if ``least`` is 1."""
    answers = read_session(recorder.folder / FILE_NAME).answers
    return sum((answer.attempt > 0) == bool(least) for answer in answers)


# How each kind of record is written, and how many of it a log then holds.
Write = Callable[[Recorder], None]
KINDS: dict[str, tuple[Write, Callable[[SessionLog], int]]] = {
    "trial": (
        lambda recorder: recorder.append(changed(ANSWER, trial=_attempts(recorder, 0))),
        lambda log: len(log.first_attempts),
    ),
    "attempt": (
        lambda recorder: recorder.append(changed(AGAIN, attempt=1 + _attempts(recorder, 1))),
        lambda log: len(log.answers) - len(log.first_attempts),
    ),
    "note": (lambda recorder: recorder.append(NOTE), lambda log: len(log.notes)),
    "mark": (lambda recorder: recorder.append(MARK), lambda log: len(log.marks)),
    "resume": (lambda recorder: recorder._log.append(RESUMPTION.to_json()), lambda log: len(log.resumptions)),
    "end": (lambda recorder: recorder.end({"work": {"draws": 3}}), lambda log: int(log.complete)),
}
BEFORE = ("trial", "note", "mark", "resume", "attempt")


def _counts(log: SessionLog) -> dict[str, int]:
    return {kind: count(log) for kind, (_, count) in KINDS.items()}


# Each byte of each kind: tests/stress.
@pytest.mark.promise("no-answer-lost")
@pytest.mark.parametrize("last", KINDS)
def test_a_cut_at_any_byte_of_the_last_record(tmp_path: Path, last: str) -> None:
    cut_the_last(tmp_path / "s", last, step=7)


def cut_the_last(folder: Path, last: str, step: int) -> None:
    """Cut the last record at each ``step``-th byte and at its first and last ones, and go on from there."""
    with Recorder.create(folder, HEADER) as recorder:
        for kind in BEFORE:
            KINDS[kind][0](recorder)
        before = _counts(read_session(folder / FILE_NAME))
        KINDS[last][0](recorder)
    content = (folder / FILE_NAME).read_bytes()
    after = _counts(read_session(folder / FILE_NAME))
    assert after == {**before, last: before[last] + 1}
    first, end = content[:-1].rindex(b"\n") + 1, len(content)
    for cut in (cut for cut in range(first, end) if cut < first + 4 or cut >= end - 4 or cut % step == 0):
        (folder / FILE_NAME).write_bytes(content[:cut])
        whole = cut >= len(content) - 1  # only the line's end is missing
        recorder, log = Recorder.reopen(folder)
        with recorder:
            assert _counts(log) == (after if whole else before), cut
            if whole and last == "end":
                continue
            KINDS[last][0](recorder)
        again = read_session(folder / FILE_NAME)
        assert again.torn_tail == b""
        expected = {**after, last: after[last] + whole} if last != "end" else after
        assert _counts(again) == expected, cut


def test_what_a_power_cut_left_of_zeros_is_no_record(tmp_path: Path) -> None:
    """Some file systems grow a file before its bytes are there."""
    folder = tmp_path / "s"
    with Recorder.create(folder, HEADER) as recorder:
        recorder.append(ANSWER)
    with open(folder / FILE_NAME, "ab") as stream:
        stream.write(bytes(300))
    recorder, log = Recorder.reopen(folder)
    recorder.close()
    assert log.answers == (ANSWER,)
    assert read_session(folder / FILE_NAME).torn_tail == b""


@pytest.mark.parametrize(
    "line",
    [
        b'{"record":"note","text":"to' + b"\n",
        b'{"record":"note"}\n',
        b'{"record":"note","text":"a","by":"b","block":0,"trial":0,"utc":"","more":1}\n',
        b'{"record":"mark","block":1}\n',
        b'{"record":"resume"}\n',
        b'{"record":"trial","block":0,"trial":0,"kind":"","response_time_s":0,"utc":"","events":[["a",%s]]}\n'
        % (b"9" * 400),
        b"\xff\xfe\n",
        bytes(40) + b"\n",
        b"[" * 100_000 + b"]" * 100_000 + b"\n",
        b'{"record":"note","text":' + b"[" * 100_000 + b"\n",
        b"[]\n",
        b"7\n",
        b'"note"\n',
    ],
    ids=lambda line: line[:24].decode("latin-1"),
)
def test_a_broken_line_in_the_middle_is_refused_with_its_place(
    tmp_path: Path, line: bytes, unchained: Callable[[Path], None]
) -> None:
    file = tmp_path / "s" / FILE_NAME
    with Recorder.create(file.parent, HEADER) as recorder:
        recorder.append(NOTE)
        recorder.append(NOTE)
    header, *notes = file.read_bytes().splitlines(keepends=True)
    file.write_bytes(b"".join([header, notes[0], line, notes[1]]))
    with pytest.raises(ResultsError, match=r"session.jsonl:3:1: "):
        read_session(file)
    file.write_bytes(b"".join([header, *notes]))
    unchained(file)
    header, *notes = file.read_bytes().splitlines(keepends=True)
    file.write_bytes(b"".join([header, notes[0], line, notes[1]]))
    with pytest.raises(ResultsError, match=r"session.jsonl:3:1: "):
        read_session(file)
