"""Some mutants of every kind of file, what was crafted to do harm, what once did, and the watch over them."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import pytest

from documents import InputError
from tests.stress.mutants import Format, difference, edited, formats, keys_of, mutant, read_all

pytestmark = pytest.mark.nightly
MODULE = "tests.stress.foreign_formats"


def test_mutants_are_read_or_refused() -> None:
    numbers = {name: range(2) if form.suffix == ".yaml" else range(25) for name, form in formats(MODULE).items()}
    # What is as large and deep as YAML may be takes seconds to refuse: it is left to the stress test.
    keys = [key for key in keys_of(MODULE, numbers) if isinstance(key[1], int) or key[0] != "experiment"]
    outcome = read_all(MODULE, keys)
    assert not outcome.faults, str(outcome)
    assert sum(outcome.counts.values()) == len(keys)
    assert {what for _, what in outcome.counts} == {"read", "refused"}


def test_a_mutant_is_the_same_each_time_and_can_be_made_from_what_changed() -> None:
    for form in formats(MODULE).values():
        base = form.bases()[0]
        for number in range(20):
            data = mutant(form, number)
            assert data == mutant(form, number)
            assert edited(base, difference(base, data)) == data


def _read(path: Path) -> None:
    """Read a number of one digit, badly."""
    text = path.read_bytes()
    if text == b"1":
        os.kill(os.getpid(), signal.SIGSEGV)
    if text == b"2":
        raise ZeroDivisionError(text)
    if text == b"3":
        raise InputError("two\nlines")
    if text == b"4":
        bytearray(3 << 30)
    if text == b"5":
        raise InputError("this is 5")
    if text == b"6":
        raise InputError([])


FORMATS = (Format("digit", ".txt", lambda: (b"0",), _read, crafted=lambda: {n: n.encode() for n in "0123456"}),)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits a process's memory")
def test_each_kind_of_fault_is_seen_and_the_rest_are_read() -> None:
    outcome = read_all("tests.documents.files.test_mutants", [("digit", n) for n in "0123456"])
    assert set(outcome.faults) == {("digit", n) for n in "1246"}, str(outcome)
    assert (outcome.counts["digit", "read"], outcome.counts["digit", "refused"]) == (1, 2)
    for number, words in (("1", "ended with -11"), ("2", "ZeroDivisionError"), ("4", "MemoryError"), ("6", "findings")):
        assert words in outcome.faults["digit", number]
