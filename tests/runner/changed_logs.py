"""Logs of sessions of every kind, and ways to change them: flipped bits and edited lines, with the line to name."""

from __future__ import annotations

import json
import random
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from analysis.errors import ResultsError
from analysis.records import FILE_NAME, read_session
from analysis.seals import check_log
from runner.session import Recorder, Session
from tests.answers import altered
from tests.runner.every_kind import HEADER, Fickle, Stage, blocks_of


def recorded(folder: Path, kind: str, variant: int, observer: str, *, end: bool = True) -> list[bytes]:
    """Return the lines of a session of ``kind`` as it is recorded, up to its end or to before that."""
    place = folder / f"{kind}-{variant}-{observer}"
    with Recorder.create(place, altered(HEADER, observer=observer)) as recorder:
        session = Session(blocks_of(kind, variant, observer), Stage(), Fickle(int(observer)), recorder)
        session.note("a note — µ", "experimenter")
        session.run()
    lines = (place / FILE_NAME).read_bytes().splitlines(keepends=True)
    return lines if end else lines[:-1]


def refused(file: Path, content: bytes, number: int) -> None:
    """Check that all that reads logs names line ``number`` of ``content``, and what is wrong with it."""
    file.write_bytes(content)
    checked = check_log(file)
    assert number in {finding.line for finding in checked.findings}, (number, checked.findings)
    with pytest.raises(ResultsError) as caught:
        read_session(file)
    (finding,) = caught.value.findings
    assert finding.line == number, (number, finding)
    assert finding.file == str(file)
    assert finding.remedy


def flip(rng: random.Random, lines: Sequence[bytes]) -> tuple[bytes, int]:
    """Return the lines with one bit flipped, and the number of the line that it was in."""
    content = bytearray(b"".join(lines))
    place = rng.randrange(len(content))
    content[place] ^= 1 << rng.randrange(8)
    number, end = 0, 0
    while end <= place:
        end += len(lines[number])
        number += 1
    return bytes(content), number


EDITS = ("delete", "delete several", "exchange", "duplicate", "insert", "append", "value", "header")


def edit(rng: random.Random, what: str, lines: Sequence[bytes], other: Sequence[bytes]) -> tuple[bytes, int]:
    """Return the lines edited, and the number of the line at which the change must be noticed."""
    lines, last = list(lines), len(lines)
    at = rng.randrange(last - 1)  # the last line of a log can be taken off it: it has then stopped there
    foreign = rng.choice(other)
    if what == "delete":
        return b"".join(lines[:at] + lines[at + 1 :]), at + 1
    if what == "delete several":
        until = rng.randrange(at + 1, last)
        return b"".join(lines[:at] + lines[until:]), at + 1
    if what == "exchange":
        to = rng.randrange(at + 1, last)
        lines[at], lines[to] = lines[to], lines[at]
        return b"".join(lines), at + 1
    if what == "duplicate":
        to = rng.randrange(at + 1, last + 1)
        return b"".join([*lines[:to], lines[at], *lines[to:]]), to + 1
    if what == "insert":
        to = rng.randrange(1, last + 1)
        return b"".join([*lines[:to], foreign, *lines[to:]]), to + 1
    if what == "append":
        return b"".join([*lines, *other[rng.randrange(2) :]]), last + 1
    if what == "header":
        return b"".join([other[0], *lines[1:]]), 2
    at = rng.randrange(last)
    lines[at] = _with_another_value(rng, lines[at])
    return b"".join(lines), at + 1


def _with_another_value(rng: random.Random, line: bytes) -> bytes:
    value: Any = json.loads(line)
    while True:
        node = value
        while True:
            keys = list(node) if isinstance(node, dict) else list(range(len(node)))
            if not keys:
                break
            key = rng.choice(keys)
            if isinstance(node[key], (dict, list)):
                node = node[key]
                continue
            old = node[key]
            if isinstance(old, bool) or old is None:
                node[key] = not old
            elif isinstance(old, (int, float)):
                node[key] = old + 1
            else:
                node[key] = old + "a" if old != "a" else "b"
            return (
                json.dumps(value, ensure_ascii=False, separators=(",", ":")).encode("utf-8", "backslashreplace") + b"\n"
            )
