"""Every module is imported where nothing is that only POSIX has, and no other calls it."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("documents", "devices", "stimuli", "analysis", "runner", "extensions", "cyclopean")

# The libraries are imported first: on Windows they have files of their own in place of these modules.
POSIX_MODULES = ("curses", "fcntl", "grp", "posix", "pty", "pwd", "readline", "resource", "syslog", "termios", "tty")
LIBRARIES = """
    click colour cv2 filelock glfw jinja2 matplotlib.pyplot moderngl multiprocessing.popen_spawn_posix
    multiprocessing.resource_tracker numpy OpenImageIO pandas PIL.Image pydantic rawpy rich.console rich.progress
    scipy.optimize scipy.stats serial serial.tools.list_ports skimage.registration spectral yaml
"""
NOT_THERE = {
    "os": "fork geteuid getuid getpgrp killpg mkfifo sched_getaffinity setsid tcgetpgrp uname O_CLOEXEC O_DIRECTORY",
    "select": "epoll poll",
    "signal": "SIGALRM SIGHUP SIGKILL pthread_sigmask",
    "time": "CLOCK_BOOTTIME clock_gettime",
}
CODE = """
import importlib, pkgutil, sys, types

libraries, names, attributes, packages = %r
for name in libraries.split():
    importlib.import_module(name)

class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name in names:
            raise ModuleNotFoundError(f"there is no {name} on Windows", name=name)

for name in names:
    sys.modules.pop(name, None)
sys.meta_path.insert(0, Refuse())
for owner, missing in attributes.items():
    for name in missing.split():
        if hasattr(importlib.import_module(owner), name):
            delattr(importlib.import_module(owner), name)
importlib.import_module("documents.platform").sys = types.SimpleNamespace(platform="win32")
count = 0
for package in packages:
    for found in pkgutil.walk_packages(importlib.import_module(package).__path__, package + "."):
        if not found.name.endswith("__main__"):
            importlib.import_module(found.name)
            count += 1
print(count)
"""


@pytest.mark.nightly
def test_every_module_is_imported_without_what_only_posix_has() -> None:
    code = CODE % ((LIBRARIES, POSIX_MODULES, NOT_THERE, PACKAGES),)
    command = [sys.executable, "-W", "ignore", "-c", code]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    files = sum(1 for package in PACKAGES for _ in (ROOT / package).rglob("*.py"))
    assert int(done.stdout) > 0.9 * files


# What one system has and another has not: `documents.platform` has a branch for each.
ONLY_SOME = {
    "os": {
        *("chown", "fork", "getegid", "geteuid", "getgid", "getpgid", "getpgrp", "getuid", "kill", "killpg", "mkfifo"),
        *("nice", "pread", "pwrite", "sched_getaffinity", "sched_setaffinity", "setsid", "startfile", "statvfs"),
        *("symlink", "sync", "tcgetpgrp", "tcsetpgrp", "uname", "wait", "waitpid", "O_DIRECTORY", "O_NOFOLLOW"),
        *("rename", "replace", "renames"),
    },
    "signal": {"SIGALRM", "SIGHUP", "SIGKILL", "SIGUSR1", "alarm", "pthread_kill", "pthread_sigmask", "setitimer"},
    "time": {"clock_gettime", "CLOCK_BOOTTIME", "tzset"},
    "select": {"select", "poll", "epoll"},
}
OF_PATHS = ("rename", "symlink_to", "hardlink_to")
# Each guarded by hasattr: the browser is started otherwise for the administrator.
GUARDED = {("runner/reports/results.py", "geteuid")}


# A text without any of them is not parsed, which takes long.
_DOTTED = [f"{module}[.]{name}" for module, names in ONLY_SOME.items() for name in names]
_ANY = re.compile(
    rf"\b({'|'.join([*POSIX_MODULES, 'msvcrt', 'winreg', *OF_PATHS, *_DOTTED])})\b|from ({'|'.join(ONLY_SOME)}) "
)


def _calls(text: str) -> list[tuple[int, str]]:
    """Return line and name of each use of a thing that only some systems have."""
    found: list[tuple[int, str]] = []
    for node in ast.walk(ast.parse(text)) if _ANY.search(text) else ():
        if isinstance(node, ast.Attribute):
            module = node.value.id if isinstance(node.value, ast.Name) else ""
            only_some = node.attr in ONLY_SOME.get(module, ()) or node.attr in OF_PATHS
            found += [(node.lineno, node.attr)] if only_some else []
        if isinstance(node, ast.Import):
            found += [
                (node.lineno, alias.name) for alias in node.names if alias.name in (*POSIX_MODULES, "msvcrt", "winreg")
            ]
        if isinstance(node, ast.ImportFrom):
            found += [(node.lineno, str(node.module))] if node.module in (*POSIX_MODULES, "msvcrt", "winreg") else []
            found += [(node.lineno, a.name) for a in node.names if a.name in ONLY_SOME.get(str(node.module), ())]
    return found


@pytest.mark.parametrize("package", PACKAGES)
def test_only_one_file_asks_which_system_this_is(package: str) -> None:
    wrong = []
    for file in sorted((ROOT / package).rglob("*.py")):
        name = file.relative_to(ROOT).as_posix()
        if name == "documents/platform.py":
            continue
        for line, what in _calls(file.read_text(encoding="utf-8")):
            if (name, what) not in GUARDED and not _is_of_a_data_frame(file, line):
                wrong.append(f"{name}:{line}: {what}")
    assert not wrong, "call these through documents.platform: " + ", ".join(wrong)


def _is_of_a_data_frame(file: Path, line: int) -> bool:
    """Return whether a call of rename renames columns."""
    return "rename(columns" in file.read_text(encoding="utf-8").splitlines()[line - 1]


def test_ruff_refuses_files_opened_without_an_encoding() -> None:
    """On Windows such a file is read in the code page of the machine."""
    lint = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["ruff"]["lint"]
    assert "PLW1514" in lint["select"]
    assert lint["preview"]
    assert [pattern for pattern, rules in lint["per-file-ignores"].items() if "PLW1514" in rules] == ["tests/**"]
