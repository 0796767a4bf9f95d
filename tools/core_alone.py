#!/usr/bin/env python3
"""Run the core's tests where the folder ``extensions/`` is not there: the core needs none of it.

    python tools/core_alone.py                   # all, as `make core` does
    python tools/core_alone.py tests/analysis -x

What git tracks is copied without ``extensions/`` and its tests, into an environment of its own with this one's
packages. There a test that fails since an extension could not be imported, or that has the marker ``extensions``, is
skipped and says so in a line. All others must pass.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import sysconfig
import tempfile
import venv
from collections.abc import Generator, Sequence
from pathlib import Path
from shutil import copyfile
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]
_OURS = "extensions"
_MISSED = re.compile(rf"No module named '(tests\.)?{_OURS}")
_LEFT_OUT = (f"{_OURS}/", f"tests/{_OURS}/")
# Pages, packages and the tools speak of the whole distribution.
_TESTS = ("tests/analysis", "tests/cyclopean", "tests/devices", "tests/documents", "tests/runner", "tests/stimuli")


class _Asked:
    """Notes which modules of ``extensions`` were asked for; it finds none."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def find_spec(self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None) -> None:
        if name == _OURS or name.startswith(f"{_OURS}."):
            self.names.append(name)


_ASKED = _Asked()


def pytest_configure() -> None:
    """Listen for imports from the first one on."""
    sys.meta_path.insert(0, _ASKED)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip what names extensions, by its marker."""
    for item in items:
        if item.get_closest_marker(_OURS):
            item.add_marker(pytest.mark.skip(f"it names {_OURS}/"))


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Skip a file that imports an extension."""
    report = yield
    if report.failed and _MISSED.search(str(report.longrepr)):
        report.outcome, report.longrepr = "skipped", (str(collector.path), 1, f"it imports {_OURS}/")
        report.result = []
    return report


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Skip a test that failed where an extension was asked for, here or in another process, with its name."""
    report = yield
    said = str(report.longrepr)
    if report.failed and (_ASKED.names or _MISSED.search(said)):
        named = re.search(rf"\b{_OURS}\.\w+", said)
        report.outcome, report.longrepr = "skipped", (str(item.path), 1, f"it needs {named[0] if named else _OURS}")
    if call.when == "teardown":
        _ASKED.names.clear()
    return report


def copied(folder: Path) -> None:
    """Copy what git tracks, as it is in the checkout, without the extensions."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    for name in filter(None, listed.split("\0")):
        if not name.startswith(_LEFT_OUT) and (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            copyfile(ROOT / name, folder / name)


def environment(folder: Path, checkout: Path) -> Path:
    """Return the Python of a new environment: ``checkout``, then this environment's packages, without its checkout."""
    venv.create(folder, symlinks=True)
    scripts, packages = (Path(sysconfig.get_path(name, vars={"base": str(folder)})) for name in ("scripts", "purelib"))
    (packages / "core.pth").write_text(f"{checkout}\n{sysconfig.get_path('purelib')}\n", encoding="utf-8")
    python = scripts / "python"
    command = scripts / "cyclopean"
    command.write_text(
        f"#!{python}\nimport sys\nfrom runner.cli.main import main\nsys.exit(main())\n", encoding="utf-8"
    )
    command.chmod(0o755)
    return python


def main(words: Sequence[str]) -> int:
    """Run pytest with ``words``, or on all of the core's tests; return its exit status."""
    with tempfile.TemporaryDirectory(prefix="core-alone-") as temporary:
        checkout = Path(temporary, "checkout")
        copied(checkout)
        python = environment(Path(temporary, "venv"), checkout)
        pytest_words = ["-q", "-p", "tools.core_alone", *(words or ("-n", "auto", "--share", *_TESTS))]
        environ = {**os.environ, "PYTHONPATH": str(checkout)}
        return subprocess.run(
            [python, "-m", "pytest", *pytest_words], cwd=checkout, env=environ, check=False
        ).returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
