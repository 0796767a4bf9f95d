"""Files with all their text or none."""

from __future__ import annotations

from pathlib import Path

import pytest

from documents.files.atomic import whole_file, write_whole


def test_a_file_is_written_with_its_folder_and_nothing_beside_it(tmp_path: Path) -> None:
    file = tmp_path / "new" / "folder" / "page.html"
    write_whole(file, "ΔE00\r\nsecond\n")
    assert file.read_bytes() == "ΔE00\r\nsecond\n".encode()
    write_whole(file, "other")
    assert file.read_text(encoding="utf-8") == "other"
    assert list(file.parent.iterdir()) == [file]
    assert file.stat().st_mode & 0o077 == _usual_mode(tmp_path) & 0o077


def _usual_mode(folder: Path) -> int:
    other = folder / "usual"
    other.touch()
    return other.stat().st_mode


def test_what_was_there_stays_when_writing_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "page.html"
    file.write_text("before", encoding="utf-8")

    def full(self: Path, data: bytes) -> int:
        with open(self, "wb") as stream:
            stream.write(data[:3])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space"):
        write_whole(file, "after")
    assert file.read_text(encoding="utf-8") == "before"
    assert list(tmp_path.iterdir()) == [file]


def test_what_is_no_text_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(UnicodeEncodeError):
        write_whole(tmp_path / "page.html", "\ud800")
    assert not list(tmp_path.iterdir())


def test_a_folder_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "page.html").mkdir()
    with pytest.raises(OSError):  # noqa: PT011  # which one differs between systems
        write_whole(tmp_path / "page.html", "text")
    assert [one.name for one in tmp_path.iterdir()] == ["page.html"]


def test_a_body_that_fails_leaves_nothing(tmp_path: Path) -> None:
    def fail() -> None:
        with whole_file(tmp_path / "plate.exr", keep_suffix=True) as draft:
            draft.write_bytes(b"half")
            assert draft.suffix == ".exr"
            raise ValueError("halfway")

    with pytest.raises(ValueError, match="halfway"):
        fail()
    assert list(tmp_path.iterdir()) == []
