"""The file layer as Windows has it, on any system, for tests that ask for the fixture ``windows``.

What is open in this process can be neither renamed, replaced nor removed; no folder takes the place of another; no file
is named as a device; names end neither in a dot nor in a space.
"""

from __future__ import annotations

import builtins
import errno
import os
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

RESERVED = re.compile(r"(con|prn|aux|nul|com[0-9¹²³]|lpt[0-9¹²³])(\..*)?", re.IGNORECASE)


def _is_open(path: str) -> bool:
    """Return whether this process has the file open, or one in the folder."""
    here = os.path.realpath(path)
    found = False
    for number in os.listdir("/proc/self/fd"):
        try:
            target = os.readlink(f"/proc/self/fd/{number}")
        except OSError:
            continue
        found = found or target == here or target.startswith(here + os.sep)
    return found


def _refuse(path: str) -> None:
    raise PermissionError(errno.EACCES, "The process cannot access the file because it is being used", path)


def _check_name(path: Any) -> None:
    name = os.path.basename(os.fspath(path)) if not isinstance(path, int) else ""
    if isinstance(name, bytes):
        name = os.fsdecode(name)
    dotted = name.endswith((" ", ".")) and name not in (".", "..")
    if RESERVED.fullmatch(name) or dotted or re.search(r'[<>:"|?*]', name):
        raise OSError(errno.EINVAL, "The filename, directory name, or volume label syntax is incorrect", name)


@pytest.fixture
def windows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let files behave as they do on Windows."""
    if not Path("/proc/self/fd").is_dir():
        pytest.skip("needs /proc, to know which files are open")
    real = {name: getattr(os, name) for name in ("replace", "rename", "unlink", "remove", "rmdir", "mkdir", "open")}
    real_open = builtins.open

    def renaming(name: str) -> Callable[..., None]:
        def rename(source: Any, target: Any, **options: Any) -> None:
            _check_name(target)
            for path in (source, target):
                if _is_open(os.fspath(path)):
                    _refuse(os.fspath(path))
            if os.path.isdir(target) or (name == "rename" and os.path.exists(target)):
                _refuse(os.fspath(target))
            real[name](source, target, **options)

        return rename

    def removing(name: str) -> Callable[..., None]:
        def remove(path: Any, *, dir_fd: int | None = None) -> None:
            if dir_fd is None and _is_open(os.fspath(path)):
                _refuse(os.fspath(path))
            real[name](path, dir_fd=dir_fd)

        return remove

    def mkdir(path: Any, *arguments: Any, **options: Any) -> None:
        _check_name(path)
        real["mkdir"](path, *arguments, **options)

    def opened(file: Any, mode: str = "r", *arguments: Any, **options: Any) -> Any:
        _check_name(file)
        if Path(str(file)).is_dir():
            _refuse(str(file))
        return real_open(file, mode, *arguments, **options)

    def low_open(path: Any, flags: int, *arguments: Any, **options: Any) -> int:
        if os.path.isdir(path) and not options.get("dir_fd") and not flags & os.O_DIRECTORY:
            _refuse(str(path))  # a folder cannot be opened; shutil walks by descriptors where there are some
        number: int = real["open"](path, flags, *arguments, **options)
        return number

    for name in ("replace", "rename"):
        monkeypatch.setattr(os, name, renaming(name))
    for name in ("unlink", "remove"):
        monkeypatch.setattr(os, name, removing(name))
    monkeypatch.setattr(os, "mkdir", mkdir)
    monkeypatch.setattr("shutil._use_fd_functions", False)
    monkeypatch.setattr(os, "open", low_open)
    monkeypatch.setattr(builtins, "open", opened)
    monkeypatch.setattr("io.open", opened)
    monkeypatch.setattr("documents.platform.sys", _System("win32"))
    monkeypatch.setattr("documents.platform._WAITS_S", (0.01,) * 20)


class _System:
    """`sys` as `documents.platform` sees it: of another platform."""

    def __init__(self, platform: str) -> None:
        self.platform = platform

    def __getattr__(self, name: str) -> Any:
        return getattr(sys, name)
