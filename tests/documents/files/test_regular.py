"""Files are opened one way: regular ones, up to a limit, whatever stands at the path and however it got there."""

from __future__ import annotations

import os
import socket
import sys
import threading
from contextlib import suppress
from pathlib import Path

import pytest

from documents import InputError
from documents.files import inside, open_regular, read_regular, read_regular_text, regular_files

posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such files")


class _TableError(InputError):
    pass


def refused(path: str | Path, limit_bytes: int = 100) -> str:
    """Return what is wrong with the file at ``path``, as one line."""
    with pytest.raises(_TableError) as caught:
        read_regular(path, limit_bytes, "table", error=_TableError)
    (finding,) = caught.value.findings
    assert finding.file == str(path)
    assert "\n" not in str(finding)
    return str(finding).removeprefix(f"{path}: ")


def test_a_file_is_read_whole(tmp_path: Path) -> None:
    file = tmp_path / "table.csv"
    file.write_bytes(b"a,b\r\n")
    assert read_regular(file, 5) == b"a,b\r\n"
    assert read_regular(str(file), 10**15) == b"a,b\r\n"
    assert read_regular_text(file, 5) == "a,b\r\n"
    file.write_bytes(b"")
    assert read_regular(file, 0) == b""


def test_a_file_is_read_up_to_its_limit_and_no_further(tmp_path: Path) -> None:
    file = tmp_path / "table.csv"
    file.write_bytes(b"x" * 101)
    assert refused(file) == "the table is larger than 100 bytes"
    with file.open("r+b") as stream:
        stream.truncate(10**12)  # as large as a disk, and takes no place on it
    assert refused(file, 10_000_000) == "the table is larger than 10 MB"


def test_a_file_that_grows_while_it_is_read_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "table.csv"
    file.write_bytes(b"x" * 50)
    open_file = regular_files.open_regular

    def growing(*args: object, **kwargs: object) -> object:
        stream = open_file(*args, **kwargs)  # type: ignore[arg-type]  # passed on as they are
        with file.open("ab") as more:
            more.write(b"x" * 51)
        return stream

    monkeypatch.setattr(regular_files, "open_regular", growing)
    assert refused(file) == "the table is larger than 100 bytes"


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="this system has no files without a size")
def test_a_file_that_states_no_size_is_read() -> None:
    assert b"Name:" in read_regular("/proc/self/status", 100_000)


def test_what_is_missing_is_named_with_what_is_like_it(tmp_path: Path) -> None:
    (tmp_path / "readings.csv").touch()
    assert refused(tmp_path / "reading.csv").startswith("there is no such file (looked for ")
    assert "did you mean 'readings.csv'?" in refused(tmp_path / "reading.csv")


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    assert refused(tmp_path).startswith("this is a folder")


@pytest.mark.parametrize("name", ["a\0b", "\udcff", "x" * 5000])
def test_names_that_no_file_can_have_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError):
        read_regular(tmp_path / name, 100)


@posix
@pytest.mark.parametrize("linked", [False, True])
def test_a_pipe_that_nobody_writes_to_is_not_waited_for(tmp_path: Path, linked: bool) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    if linked:
        path = tmp_path / "link"
        path.symlink_to("pipe")
    assert refused(path).startswith(f"this is {'a link to ' if linked else ''}a pipe, not a file (")


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="this system has no file without an end")
def test_a_device_is_no_file(tmp_path: Path) -> None:
    (tmp_path / "table.csv").symlink_to("/dev/zero")
    (tmp_path / "again.csv").symlink_to("table.csv")
    assert refused("/dev/zero").startswith("this is a device")
    assert refused(tmp_path / "again.csv").startswith("this is a link to a device")


@posix
def test_links_that_go_round_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    assert refused(tmp_path / "a").startswith("the table cannot be read: ")
    assert inside(tmp_path, tmp_path / "a")


@posix
def test_what_is_put_in_a_files_place_as_it_is_opened_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "table.csv"
    file.touch()
    look = regular_files._refuse_others

    def replaced(*args: object) -> None:
        look(*args)  # type: ignore[arg-type]  # passed on as they are
        if file.is_file():
            file.unlink()
            os.mkfifo(file)

    monkeypatch.setattr(regular_files, "_refuse_others", replaced)
    done: list[str] = []
    attempt = threading.Thread(target=lambda: done.append(refused(file)), daemon=True)
    attempt.start()
    attempt.join(10)
    assert done
    assert "this is a pipe" in done[0]


def test_text_that_is_not_utf8_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "table.csv"
    file.write_bytes(b"\xef\xbb\xbfa,b\n")
    assert read_regular_text(file, 100) == "a,b\n"
    file.write_bytes(b"a,\xff\n")
    with pytest.raises(InputError, match="the table is not UTF-8 text"):
        read_regular_text(file, 100, "table")


def test_no_file_stays_open_where_one_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Other threads, as of a lock's signs of life, open files meanwhile and take numbers that are free again."""
    file = tmp_path / "table.csv"
    file.write_bytes(b"x" * 11)
    opened: list[int] = []
    really_open = os.open

    def remembered(path: Path, *args: int) -> int:
        descriptor = really_open(path, *args)
        if path == file:
            opened.append(descriptor)
        return descriptor

    monkeypatch.setattr(os, "open", remembered)
    with pytest.raises(InputError):
        open_regular(file, limit_bytes=10)
    (descriptor,) = opened
    with suppress(OSError):  # the number is free, or of another file by now
        assert not os.path.samestat(os.fstat(descriptor), file.stat())


def test_a_path_stays_inside_its_folder(tmp_path: Path) -> None:
    study = tmp_path / "study"
    (study / "pictures").mkdir(parents=True)
    (tmp_path / "secret").touch()
    assert inside(study, study / "pictures" / "a.exr") == (study / "pictures" / "a.exr").resolve()
    assert inside(study, study) == study.resolve()
    for outside in (tmp_path / "secret", study / "pictures" / ".." / ".." / "secret", tmp_path / "study2"):
        with pytest.raises(_TableError, match="this leads out of the folder"):
            inside(study, outside, error=_TableError)


@posix
def test_a_link_is_followed_before_it_is_inside(tmp_path: Path) -> None:
    study = tmp_path / "study"
    study.mkdir()
    (tmp_path / "secret").touch()
    (study / "out").symlink_to(tmp_path / "secret")
    (study / "up").symlink_to("..")
    (study / "own").touch()
    (study / "in").symlink_to("own")
    (tmp_path / "by another name").symlink_to(study)
    assert inside(study, study / "in") == (study / "own").resolve()
    assert inside(tmp_path / "by another name", study / "in") == (study / "own").resolve()
    for outside in (study / "out", study / "up" / "secret", study / "up" / "new"):
        with pytest.raises(InputError, match="this leads out of the folder"):
            inside(study, outside)


@posix
def test_a_socket_is_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # a socket's path is short
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind("socket")
        assert refused("socket") == "this is a socket, not a file (name a file)"
