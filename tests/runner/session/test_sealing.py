"""A seal names every file of results, and finds what was changed, removed or added since."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from filelock import FileLock

from analysis.errors import ResultsError
from analysis.records import session_files
from analysis.seals import check_seal, read_seal
from documents import InputError
from runner.reports import ReportOptions, report_results
from runner.session import seal_results


def test_the_seal_names_every_file_and_its_own_hash(results: Path) -> None:
    seal = seal_results(results)
    names = set(seal.content.files)
    assert sum(name.endswith("session.jsonl") for name in names) == 2
    assert any(name.endswith("small.yaml") for name in names)
    assert any(name.endswith("display.yaml") for name in names)
    assert any(name.endswith("stimuli.json") for name in names)
    assert not [name for name in names if "/." in name]
    for name, digest in seal.content.files.items():
        assert hashlib.sha256((results / name).read_bytes()).hexdigest() == digest
    assert seal.digest == hashlib.sha256((results / "seal.json").read_bytes()).hexdigest()
    assert seal.content.packages["numpy"]
    assert seal.content.observers == 2
    assert check_seal(results).findings == ()


def flip(results: Path) -> None:
    file = min(session_files(results))
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(data)


def cut(results: Path) -> None:
    file = min(session_files(results))
    lines = file.read_bytes().splitlines(keepends=True)
    file.write_bytes(b"".join(lines[:-1]))  # no chain of checksums shows that a log ends a line earlier


def remove(results: Path) -> None:
    next(results.rglob("recipe.yaml")).unlink()


def add(results: Path) -> None:
    shutil.copy(min(session_files(results)), results / "copy.jsonl")


@pytest.mark.parametrize(
    ("change", "words"),
    [(flip, "not as sealed"), (cut, "not as sealed"), (remove, "is missing"), (add, "not in the seal")],
)
def test_each_change_is_named(results: Path, change: Callable[[Path], None], words: str) -> None:
    seal_results(results)
    change(results)
    (finding,) = check_seal(results).findings
    assert words in finding.message


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_a_report_in_the_folder_is_no_change(results: Path) -> None:
    seal = seal_results(results)
    written = report_results([results], options=ReportOptions(pictures=False))
    assert written.page.parent == results
    assert check_seal(results).findings == ()
    (note,) = [note for note in written.report.notes if "sealed" in note]
    assert seal.digest in note
    assert "the logs are as sealed" in note


@pytest.mark.usefixtures("undrawn")
@pytest.mark.nightly
def test_a_report_says_that_logs_are_not_as_sealed(results: Path) -> None:
    seal_results(results)
    cut(results)
    written = report_results([results / "small"], options=ReportOptions(pictures=False))
    assert any("1 of 2 logs are not as sealed" in note for note in written.report.notes)


def test_results_are_sealed_again_only_if_asked(results: Path) -> None:
    first = seal_results(results)
    with pytest.raises(InputError, match="--replace"):
        seal_results(results)
    assert seal_results(results, replace=True).content.replaces == first.digest


def test_what_cannot_be_sealed_is_refused(results: Path) -> None:
    file = min(session_files(results))
    with FileLock(file.parent / ".lock"), pytest.raises(InputError, match="1 session is being written"):
        seal_results(results)
    (results / "link.yaml").symlink_to(file)
    with pytest.raises(ResultsError, match="symbolic link"):
        seal_results(results)
    assert read_seal(results) is None


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"schema_version": 2}', "\udc80"])
def test_a_damaged_seal_is_refused(results: Path, text: str) -> None:
    (results / "seal.json").write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(ResultsError, match="no seal"):
        check_seal(results)


def test_the_command_prints_what_to_cite(results: Path, cyclopean: Callable[..., Any]) -> None:
    done = cyclopean("seal", results).stdout
    digest = hashlib.sha256((results / "seal.json").read_bytes()).hexdigest()
    assert digest in done
    assert json.loads(cyclopean("seal", results, "--replace", "--json").stdout)["replaces"] == digest
