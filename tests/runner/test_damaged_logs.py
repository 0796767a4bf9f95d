"""A damaged log without checksums is refused in one line with its place, or whatever reads it comes to its end."""

from __future__ import annotations

import json
import shutil
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

import cyclopean as face
from analysis.errors import ResultsError
from analysis.records import SessionLog, read_session, session_files
from documents import InputError
from runner.observers.presses import Replay, asked_after_their_block
from tests.runner.log_mutants import CHANGES, Mutant, mutants, written

RECORDED = Path(__file__).parent / "recorded" / "results"
LOGS: Mapping[str, Path] = {"/".join(file.parts[-4:-2]): file for file in sorted(session_files(RECORDED))}
# Mutants that once ended in a traceback or were believed, by log, change and seed.
CORPUS = json.loads((Path(__file__).parent / "log_mutants.json").read_text())
# A line that is missing at the end, or a key that an answer may have or not, is not missed without checksums.
NOT_NOTICED = {"delete a line", "add a key", "remove a key", "rename a key", "another record"}
SCORED = ("chosen", "rejected", "answer", "first", "second", "stimulus", "series", "ratings", "correct", "outcome")


def read(content: bytes, folder: Path) -> SessionLog | None:
    """Return the log; None if it is refused, as it should be: in a line, with file and number."""
    file = folder / "session.jsonl"
    file.write_bytes(content)
    try:
        return read_session(file)
    except ResultsError as error:
        told = str(error)
    assert told.startswith(f"{file}:")
    assert "\n" not in told
    assert "restore the file" in told
    return None


def what_counts(log: SessionLog) -> list[Any]:
    """Return what scores and response times are made from, in any order."""
    return sorted(
        (answer.place, answer.attempt, answer.kind, round(answer.response_time_s, 4))
        + tuple(json.dumps(answer.details().get(key)) for key in SCORED)
        for answer in log.answers
        if answer.kind != "questionnaire"
    )


def put(content: bytes, folder: Path, log: str) -> Path:
    """Write a log as one among its experiment's sessions, in ``folder``, and return its file."""
    original = LOGS[log]
    experiment = folder / "results" / original.parts[-4]
    shutil.rmtree(experiment, ignore_errors=True)
    shutil.copytree(original.parents[2], experiment)
    file = folder / "results" / original.relative_to(RECORDED)
    file.write_bytes(content)
    return file


def use(file: Path, cyclopean: Callable[..., Any]) -> None:
    """Let everything read the sessions of the log's experiment: an exception but `InputError` is raised."""
    results, out = file.parents[2], file.parents[4] / "out"
    shutil.rmtree(out, ignore_errors=True)
    for command in (
        ("report", results, "-o", out / "report.html", "--csv", out / "tables"),
        ("export", results, "-o", out / "bids"),
        ("verify", results),
    ):
        assert cyclopean(*command, expect=None).returncode in (0, 1, 2)
    for call in (face.scores, face.read_results):
        with suppress(InputError):
            call(results)
    log = read_session(file)
    Replay.of(log)
    asked_after_their_block(log)


def made(seeds: Iterable[int]) -> Iterator[tuple[str, Mutant]]:
    """Yield a mutant of one of the recorded logs for each seed."""
    names = list(LOGS)
    for seed in seeds:
        for mutant in mutants(LOGS[names[seed % len(names)]].read_bytes(), [seed]):
            yield names[seed % len(names)], mutant


def found(entry: Mapping[str, Any]) -> Iterator[Mutant]:
    """Yield the mutant of an entry of the corpus."""
    yield from mutants(LOGS[entry["log"]].read_bytes(), [entry["seed"]], [entry["change"]])


def test_a_log_as_it_was_recorded_is_no_mutant(tmp_path: Path) -> None:
    for log in LOGS.values():
        assert written([json.loads(line) for line in log.read_bytes().splitlines()]) == log.read_bytes()
        assert read(log.read_bytes(), tmp_path)


def test_damaged_logs_are_refused_or_say_what_they_said(tmp_path: Path) -> None:
    original = {name: what_counts(read_session(log)) for name, log in LOGS.items()}
    tried: Counter[str] = Counter()
    believed: Counter[str] = Counter()
    for name, mutant in made(range(250)):
        tried[mutant.change] += 1
        damaged = read(mutant.content, tmp_path)
        if damaged is not None and what_counts(damaged) != original[name]:
            believed[mutant.change] += 1
    assert set(tried) == set(CHANGES)
    assert set(believed) <= NOT_NOTICED, believed


@pytest.mark.parametrize("entry", CORPUS, ids=lambda entry: f"{entry['log']} {entry['change']} {entry['seed']}")
def test_what_was_found_is_refused_or_used(
    entry: Mapping[str, Any], tmp_path: Path, cyclopean: Callable[..., Any]
) -> None:
    for mutant in found(entry):
        damaged = read(mutant.content, tmp_path)
        assert (damaged is None) == entry["refused"]
        if damaged is not None:
            use(put(mutant.content, tmp_path, entry["log"]), cyclopean)
