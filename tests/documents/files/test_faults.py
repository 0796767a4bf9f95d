"""Too many open files, no memory, a failing or full disk: said as such, by every reader, and never a damaged file."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest

from analysis.comparisons import read_any
from analysis.records import check_log, read_session
from devices.display import read_display
from devices.profiles import read_profile
from devices.readings import read_measurements
from documents import InputError, read_yaml
from documents.files import DurableLog, system_fault, unwritable
from stimuli.pictures import StereoImage, picture_input, read_coded, read_exr, read_picture, write_exr

CODES = ("EMFILE", "ENFILE", "ENOMEM", "EIO", "EROFS", "ENOSPC", "EDQUOT", "EFBIG", "EOVERFLOW")


def read_srgb(path: Path) -> object:
    """Read a picture that declares nothing."""
    return read_picture(path, "srgb", white_luminance_cd_m2=100)


READERS: dict[str, Callable[[Path], object]] = {
    "picture.png": read_srgb,
    "picture.jpg": read_srgb,
    "picture.tif": read_srgb,
    "picture.webp": read_srgb,
    "picture.exr": read_exr,
    "picture.codes": read_coded,
    "profile.icc": read_profile,
    "readings.ti3": read_measurements,
    "readings.csv": read_measurements,
    "display.yaml": read_display,
    "recipe.yaml": read_yaml,
    "table.csv": read_any,
    "session.jsonl": read_session,
    "log.jsonl": check_log,
}


def _refused(read: Callable[[Path], object], path: Path) -> str:
    with pytest.raises(InputError) as refused:
        read(path)
    (finding,) = refused.value.findings
    assert finding.file == str(path)
    assert finding.remedy
    return finding.message


@pytest.fixture
def fail_to_open(monkeypatch: pytest.MonkeyPatch) -> Callable[[Path, str], None]:
    """Let the system refuse to open a file, with an error of its own."""
    real = os.open

    def fail(path: Path, code: str) -> None:
        def refused(name: Any, *more: Any, **other: Any) -> int:
            if str(name) == str(path):
                number = getattr(errno, code)
                raise OSError(number, os.strerror(number), str(name))
            return real(name, *more, **other)

        monkeypatch.setattr(os, "open", refused)

    return fail


@pytest.mark.parametrize("code", [code for code in CODES if hasattr(errno, code)])
@pytest.mark.parametrize("name", READERS)
def test_what_the_machine_cannot_do_is_said_of_each_kind_of_file(
    name: str, code: str, tmp_path: Path, fail_to_open: Callable[[Path, str], None]
) -> None:
    path = tmp_path / name
    path.write_bytes(b"whatever it holds, it is not looked at")
    fail_to_open(path, code)
    message = _refused(READERS[name], path)
    assert f"({code})" in message
    assert "damaged" not in message
    assert "no picture" not in message


@pytest.mark.skipif(sys.platform != "linux", reason="a file that is there and cannot be read is Linux's")
@pytest.mark.parametrize("name", READERS)
def test_a_disk_that_fails_while_it_is_read_is_said(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.symlink_to("/proc/self/mem")
    message = _refused(READERS[name], path)
    assert "(EIO)" in message
    assert "damaged" not in message


def _cut_short(tmp_path: Path) -> list[tuple[Path, Callable[[Path], object]]]:
    from PIL import Image

    rng = np.random.default_rng(1)
    grey = rng.integers(0, 255, (60, 80, 3), np.uint8)
    files = [tmp_path / f"picture.{kind}" for kind in ("png", "jpg", "tif", "webp")]
    for file in files:
        Image.fromarray(grey).save(file)
    light = tmp_path / "picture.exr"
    write_exr(light, StereoImage.flat(rng.uniform(0, 1, (60, 80, 3)).astype(np.float32)))
    for file in (*files, light):
        file.write_bytes(file.read_bytes()[:-2000])
    return [*((file, read_srgb) for file in files), (light, read_exr)]


@pytest.mark.parametrize("code", ["EMFILE", "EIO", "ENOMEM"])
def test_the_reason_that_a_library_keeps_to_itself_is_found(
    code: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """OpenImageIO and Pillow fail, and only reading the file again says why."""
    files = _cut_short(tmp_path)
    for path, read in files:
        message = _refused(read, path)
        assert not [code for code in CODES if code in message], message  # of these the file is at fault
        assert any(word in message for word in ("damaged", "cut short", "cannot be read")), message
    number = getattr(errno, code)
    monkeypatch.setattr(picture_input, "what_stops_reading", lambda path: OSError(number, os.strerror(number)))
    said = [_refused(read, path) for path, read in files]
    assert sum(f"({code})" in message for message in said) >= 4, said
    assert not [message for message in said if f"({code})" in message and "damaged" in message]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such limit")
def test_too_many_open_files_are_said_by_the_program(tmp_path: Path, cyclopean: Callable[..., Any]) -> None:
    import resource

    file = tmp_path / "session.jsonl"
    with DurableLog.create(file, tmp_path / ".lock", {"record": "session"}):
        pass
    cyclopean("verify", file, expect=1)  # all that it imports
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    lowest_free = os.open(os.devnull, os.O_RDONLY)
    os.close(lowest_free)
    try:
        resource.setrlimit(resource.RLIMIT_NOFILE, (lowest_free, before[1]))
        told = cyclopean("verify", file, expect=1).stderr
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, before)
    assert "(EMFILE)" in told
    assert "ulimit -n" in told


@pytest.mark.parametrize("error", [OSError(errno.EMFILE, "Too many open files", "x.bin"), MemoryError()])
def test_what_nobody_caught_is_a_line_and_no_traceback(
    error: BaseException, monkeypatch: pytest.MonkeyPatch, cyclopean: Callable[..., Any], tmp_path: Path
) -> None:
    import analysis.records

    def fail(*_: Any, **__: Any) -> NoReturn:
        raise error

    monkeypatch.setattr(analysis.records, "check_results", fail)
    told = cyclopean("verify", tmp_path, expect=1).stderr
    assert str(system_fault(error)) in told
    assert len(told.splitlines()) == 1


def test_other_errors_are_no_faults_of_the_machine() -> None:
    for error in (
        FileNotFoundError(errno.ENOENT, "x"),
        PermissionError(errno.EACCES, "x"),
        ValueError(24),
        OSError("x"),
    ):
        assert system_fault(error) is None
    chained = InputError("the picture cannot be read")
    chained.__cause__ = OSError(errno.EIO, "x")
    assert str(system_fault(chained)).endswith("(EIO)")


def test_a_lack_of_memory_is_no_damage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from PIL import Image

    path = tmp_path / "picture.png"
    Image.new("RGB", (8, 8)).save(path)

    def refused(*_: Any, **__: Any) -> NoReturn:
        raise MemoryError

    monkeypatch.setattr(Image, "open", refused)
    message = _refused(read_picture, path)
    assert "(ENOMEM)" in message
    assert "damaged" not in message


@pytest.mark.parametrize("code", ["EMFILE", "ENFILE", "ENOMEM", "EIO", "EOVERFLOW"])
def test_what_cannot_be_written_is_said_with_a_remedy(code: str) -> None:
    number = getattr(errno, code)
    finding = unwritable(OSError(number, os.strerror(number)), Path("page.html"), "page")
    assert f"({code})" in finding.message
    assert finding.remedy
