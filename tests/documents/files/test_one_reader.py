"""Files are opened for reading in one place, which refuses pipes and devices and has limits."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PACKAGES = ("documents", "devices", "stimuli", "analysis", "runner", "cyclopean")
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
