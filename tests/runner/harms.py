"""What other programs do to a log while it is written."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path

Harm = Callable[[Path], None]


def _replace(file: Path) -> None:
    """Do what a program that synchronises folders does, or an editor: the same bytes, as another file."""
    shutil.copy(file, file.with_name("t"))
    os.replace(file.with_name("t"), file)


def _edit(file: Path) -> None:
    """Change a byte, and no length."""
    with open(file, "r+b") as stream:
        stream.seek(file.stat().st_size // 3)
        stream.write(b"#")


def _add(file: Path) -> None:
    with open(file, "ab") as stream:
        stream.write(b'{"by":"another"}\n')


def _take_last_line(file: Path) -> None:
    os.truncate(file, file.read_bytes()[:-1].rindex(b"\n") + 1)


# Of the file alone.
TO_FILE: dict[str, Harm] = {
    "replaced": _replace,
    "removed": Path.unlink,
    "cut off": lambda file: os.truncate(file, file.stat().st_size // 2),
    "last line taken": _take_last_line,
    "emptied": lambda file: os.truncate(file, 0),
    "edited": _edit,
    "added to": _add,
}
HARMS: dict[str, Harm] = {
    **TO_FILE,
    "folder removed": lambda file: shutil.rmtree(file.parent),
    "results removed": lambda file: shutil.rmtree(file.parents[3]),
    "folder moved": lambda file: (file.parent.rename(file.parent.with_name("away")), None)[1],
}
