"""The random name of a station: kept, the same for all sessions of an account, and never in the way."""

from __future__ import annotations

from pathlib import Path

import pytest

from runner.session.header import station


def test_a_station_keeps_its_name(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("CYCLOPEAN_STATE", str(tmp_path / "one"))
    first = station()
    assert len(first) == 8
    assert station() == first
    assert [file.name for file in (tmp_path / "one").iterdir()] == ["station"]
    monkeypatch.setenv("CYCLOPEAN_STATE", str(tmp_path / "two"))
    assert station() not in ("", first)


@pytest.mark.parametrize("damage", [b"", b"\x1b[2J\n", b"0" * 10_000_000])
def test_a_damaged_name_is_made_again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, damage: bytes) -> None:
    monkeypatch.setenv("CYCLOPEAN_STATE", str(tmp_path))
    (tmp_path / "station").write_bytes(damage)
    made = station()
    assert len(made) == 8
    assert station() == made


def test_without_a_place_for_it_there_is_no_name(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("CYCLOPEAN_STATE", str(tmp_path / "file"))
    assert station() == ""
