"""Hashes that are relied on: only of files that nobody can have touched since."""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from stimuli.build.known_hashes import KnownHashes


def aged(path: Path, monkeypatch: pytest.MonkeyPatch, seconds: float = 10.0) -> None:
    """Let the clock stand later, as it would if the file had lain still for so long."""
    now = time.time_ns
    monkeypatch.setattr("stimuli.build.known_hashes.time.time_ns", lambda: now() + int(seconds * 1e9))


def known(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    file = tmp_path / "a.bin"
    file.write_bytes(b"first")
    aged(file, monkeypatch)
    hashes = KnownHashes(tmp_path / "record.json")
    assert hashes.sha256(file) == hashlib.sha256(b"first").hexdigest()
    assert hashes.hashed == 1
    hashes.keep()
    return file


def test_a_file_that_lay_still_is_not_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = known(tmp_path, monkeypatch)
    again = KnownHashes(tmp_path / "record.json")
    assert again.sha256(file) == hashlib.sha256(b"first").hexdigest()
    assert again.hashed == 0
    verified = KnownHashes(tmp_path / "record.json", verify=True)
    verified.sha256(file)
    assert verified.hashed == 1


def in_place_with_its_time_set_back(file: Path) -> None:
    before = file.stat()
    file.write_bytes(b"other")
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))


def replaced_with_its_time_set_back(file: Path) -> None:
    before = file.stat()
    other = file.with_name("b.bin")
    other.write_bytes(b"other")
    os.utime(other, ns=(before.st_atime_ns, before.st_mtime_ns))
    other.replace(file)


def longer(file: Path) -> None:
    file.write_bytes(b"first and more")


@pytest.mark.parametrize("change", [in_place_with_its_time_set_back, replaced_with_its_time_set_back, longer])
def test_whatever_changed_is_read_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: Callable[[Path], None]
) -> None:
    file = known(tmp_path, monkeypatch)
    change(file)
    assert KnownHashes(tmp_path / "record.json").sha256(file) == hashlib.sha256(file.read_bytes()).hexdigest()


def test_a_file_just_written_is_not_relied_on(tmp_path: Path) -> None:
    file = tmp_path / "a.bin"
    file.write_bytes(b"first")
    hashes = KnownHashes(tmp_path / "record.json")
    hashes.sha256(file)
    hashes.keep()
    assert not (tmp_path / "record.json").exists()
    hashes.sha256(file)
    assert hashes.hashed == 2


@pytest.mark.parametrize("record", ["", "{", "[]", '{"a": 1}', '{"a": [1, 2]}'])
def test_a_damaged_record_costs_time_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, record: str) -> None:
    file = known(tmp_path, monkeypatch)
    (tmp_path / "record.json").write_text(record)
    assert KnownHashes(tmp_path / "record.json").sha256(file) == hashlib.sha256(b"first").hexdigest()


def test_a_record_that_lies_is_found_out_by_verify(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = known(tmp_path, monkeypatch)
    record = json.loads((tmp_path / "record.json").read_text())
    record[str(file)][-1] = "0" * 64
    (tmp_path / "record.json").write_text(json.dumps(record))
    assert KnownHashes(tmp_path / "record.json").sha256(file) == "0" * 64
    assert KnownHashes(tmp_path / "record.json", verify=True).sha256(file) != "0" * 64
