from __future__ import annotations

from pathlib import Path

import pytest

from documents import Finding
from documents.files.bounded_file import bounded_bytes


def test_a_file_is_read_up_to_its_bound_and_no_further(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"x" * 10)
    assert bounded_bytes(path, 10) == b"x" * 10
    with pytest.raises(OSError, match="larger than 9e-06 MB") as caught:
        bounded_bytes(path, 9)
    assert caught.value.strerror == "it is larger than 9e-06 MB"


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="this system has no file without an end")
def test_a_file_without_an_end_is_refused() -> None:
    with pytest.raises(OSError, match="larger than 1 MB"):
        bounded_bytes("/dev/zero", 1_000_000)


@pytest.mark.parametrize("hidden", ["\u202e", "\x1b[2J", "\r", "\n", "\x00", "\x9b"])
def test_what_is_told_of_a_file_cannot_move_the_terminal(hidden: str) -> None:
    told = str(Finding(f"red is '{hidden}'", f"a{hidden}.csv", 1, 2, f"write {hidden}"))
    assert told.isprintable()
    assert told.startswith("a")


def test_what_is_told_of_a_file_has_an_end() -> None:
    told = str(Finding("x" * 10**7, "a.csv", remedy="y" * 10**7))
    assert len(told) < 1300
    assert "x…" in told
