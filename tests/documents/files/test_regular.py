"""Files are opened one way and by plain paths; a failing system is said as such, and none is damaged."""

from __future__ import annotations

import ast
import errno
import os
import socket
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.comparisons import read_any
from analysis.records import read_session
from analysis.seals import check_log
from devices.display import read_display
from devices.profiles import read_profile
from devices.readings import read_measurements
from documents import InputError, read_yaml
from documents.files import (
    DurableLog,
    beside,
    inside,
    open_regular,
    read_regular,
    read_regular_text,
    regular_files,
    system_fault,
    tidy,
    unwritable,
)
from stimuli.pictures import StereoImage, picture_input, read_coded, read_exr, read_picture, write_exr

# Files are opened one way: regular ones, up to a limit, whatever stands at the path and however it got there.

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


# Paths without detours: always the same file, and plain where it certainly is.
@pytest.fixture
def folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder that is gone into: folders a/b, c, a file in each, and links to a/b and to itself."""
    for name in ("a/b", "c"):
        (tmp_path / name).mkdir(parents=True)
    for name in ("f", "a/f", "a/b/f", "c/f"):
        (tmp_path / name).write_text(name)
    (tmp_path / "c/link").symlink_to(tmp_path / "a/b")
    (tmp_path / "here").symlink_to(".")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.usefixtures("folders")
@pytest.mark.parametrize(
    ("path", "plain"),
    [
        ("a/../c/f", "c/f"),
        ("a/b/../../c/f", "c/f"),
        ("./a/../f", "f"),
        ("../x/f", "../x/f"),
        ("a/../../f", "../f"),
        ("c/link/../f", "c/link/../f"),  # a/f, not c/f
        ("none/../f", "none/../f"),  # not there to be gone through
        ("f/../c/f", "f/../c/f"),  # a file is no way through
    ],
)
def test_detours(path: str, plain: str) -> None:
    assert tidy(Path(path)) == Path(plain)


def test_absolute_paths_keep_their_root(folders: Path) -> None:
    assert tidy(folders / "a" / ".." / "f") == folders / "f"
    assert tidy(Path("/../f")) == Path("/../f")


def test_a_name_in_a_file_is_relative_to_the_file_s_folder(folders: Path) -> None:
    assert beside(Path("a/x.yaml"), "../c/f") == Path("c/f")
    assert beside(Path("a/x.yaml"), str(folders / "f")) == folders / "f"


def test_it_is_always_the_same_file(folders: Path) -> None:
    @settings(deadline=None)  # the first call of a busy disk
    @given(st.lists(st.sampled_from(["a", "b", "c", "link", "here", "..", ".", "none"]), max_size=6))
    def always(parts: list[str]) -> None:
        path = Path(*parts, "f")
        assert path.exists() == tidy(path).exists()
        assert not path.exists() or os.path.samefile(path, tidy(path))

    always()


# Files are opened for reading in one place, which refuses pipes and devices and has limits.

ROOT = Path(__file__).parents[3]
PACKAGES = ("documents", "devices", "stimuli", "analysis", "runner", "extensions", "cyclopean")
READS = {"read_text", "read_bytes", "loadmat", "fromfile", "memmap", "loadtxt", "genfromtxt", "read_excel"}
OPENS = {"open", "fdopen", "imread"}
# What is read there and why it may be. Other calls of these files are looked at as those of all others.
ALLOWED = {
    "documents/files/regular_files.py": "it is the place",
    "documents/files/access.py": "files that are written",
    "documents/files/faults.py": "to its end, for the error alone, after a library failed",
    "documents/files/atomic.py": "folders",
    "documents/files/durable_log.py": "the log that this process has locked, and what was torn off it",
    "documents/files/log_rescue.py": "the log that this process has locked, and what stands in its place",
    "documents/files/mirror.py": "the log that this process has locked, and its copy",
    "documents/platform.py": "the system's own files",
    "devices/readings/open.py": "instruments",
    "devices/readings/serial_line.py": "instruments",
    "devices/compensation/dither_mask.py": "a file of this package",
    "stimuli/spectral/bands.py": "mapped, of a size that was compared with the header",
    "stimuli/pictures/picture_input.py": "opened by OpenImageIO, after it was looked at",
    "analysis/report/shown.py": "pictures in memory",
}
ALLOWED_ROOMS = ("stimuli/pictures/", "stimuli/develop/", "stimuli/comparison/")  # they have limits in pixels


def _is_resource(call: ast.Call) -> bool:
    """Return whether a file of a package is read, as `importlib.resources` finds it."""
    return any(isinstance(node, ast.Name) and node.id in ("files", "resources") for node in ast.walk(call.func))


def _mode(call: ast.Call, place: int) -> str:
    given = [keyword.value for keyword in call.keywords if keyword.arg == "mode"] or call.args[place : place + 1]
    return str(given[0].value) if given and isinstance(given[0], ast.Constant) else "r"


def _reads(tree: ast.AST) -> list[tuple[int, str]]:
    """Return line and name of each call that opens a file for reading."""
    calls = []
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or _is_resource(node):
            continue
        is_name = isinstance(node.func, ast.Name)
        name = node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")
        if name in READS and not is_name:
            calls.append((node.lineno, name))
        if name in OPENS and not set(_mode(node, 1 if is_name or name == "fdopen" else 0)) & set("wxa"):
            calls.append((node.lineno, name))
    return calls


def _is_method_of_ours(file: Path, line: int) -> bool:
    """Return whether what is called is no opening of a file: `Station.open`, and a picture's output."""
    text = file.read_text(encoding="utf-8").splitlines()[line - 1]
    return any(word in text for word in ("Station.open(", "output.open(", "webbrowser.open(", "log._lock", "def open("))


@pytest.mark.parametrize("package", PACKAGES)
def test_files_are_read_in_one_place(package: str) -> None:
    wrong = []
    for file in sorted((ROOT / package).rglob("*.py")):
        name = file.relative_to(ROOT).as_posix()
        if name in ALLOWED or name.startswith(ALLOWED_ROOMS):
            continue
        text = file.read_text(encoding="utf-8")
        if not any(word in text for word in READS | OPENS):
            continue
        for line, call in _reads(ast.parse(text)):
            if not _is_method_of_ours(file, line):
                wrong.append(f"{name}:{line}: {call}")
    assert not wrong, "read these by documents.files.read_regular or open_regular:\n" + "\n".join(wrong)


def test_what_is_looked_for_is_seen() -> None:
    text = "open(a)\nopen(a, 'rb')\na.open()\na.read_text()\nnp.memmap(a)\n"
    text += "open(a, 'w')\na.open('xb')\nopen(a, mode='ab')\n"
    assert [line for line, _ in _reads(ast.parse(text))] == [1, 2, 3, 4, 5]
    assert not _reads(ast.parse("(files('a') / 'b').read_text()\nread_text(a)\n"))


# Too many open files, no memory, a failing or full disk: said as such, by every reader, and never a damaged file.

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
    def fail(*_: Any, **__: Any) -> NoReturn:
        raise error

    monkeypatch.setattr("analysis.seals.check.check_results", fail)
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
