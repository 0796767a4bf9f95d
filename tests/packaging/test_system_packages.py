"""`make demo` says what apt is to install and why, before it does, and `NO_APT=1` keeps apt out. Here apt is a fake."""

from __future__ import annotations

import os
import stat
import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "tools/system-packages"
pytestmark = pytest.mark.skipif(os.name == "nt", reason="a shell script")

# What it calls beside apt-get. The interpreter lacks what is asked for until apt has installed something.
PROGRAMS = {
    "apt-get": 'echo "apt-get $*" >>"$LOG"; case "$*" in *install*) [ "${APT_FAILS:-}" ] || touch "$LOG.done";; esac',
    "id": "echo 0",
    "python": 'case "${2:-}" in *version_info*) echo python3.11-venv; exit 0;; esac; [ -e "$LOG.done" ]',
}


class Machine:
    """A machine with nothing but a shell and these programs."""

    def __init__(self, folder: Path) -> None:
        self.log = folder / "log"
        self.programs = folder / "bin"
        self.programs.mkdir()
        for name, text in PROGRAMS.items():
            program = self.programs / name
            program.write_text(f"#!/bin/sh\n{text}\n")
            program.chmod(program.stat().st_mode | stat.S_IXUSR)
        for name in ("sh", "touch", "cat"):
            found = next(Path(place, name) for place in ("/bin", "/usr/bin") if Path(place, name).exists())
            os.symlink(found, self.programs / name)

    def run(self, what: str, **environment: str) -> subprocess.CompletedProcess[str]:
        """Run the script."""
        own = {"PATH": str(self.programs), "LOG": str(self.log), **environment}
        command = ["/bin/sh", str(SCRIPT), what, "python"]
        return subprocess.run(command, capture_output=True, encoding="utf-8", env=own, check=False, timeout=60)

    @property
    def apt(self) -> list[str]:
        """How apt was called."""
        return self.log.read_text().splitlines() if self.log.exists() else []


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


@pytest.mark.parametrize(
    ("what", "packages", "why"),
    [
        ("venv", "python3.11-venv", "to make the virtual environment"),
        ("gl", "libegl1 libgl1 libgl1-mesa-dri", "OpenGL in software, to draw without a graphics card"),
    ],
)
def test_it_says_first_what_and_why(machine: Machine, what: str, packages: str, why: str) -> None:
    done = machine.run(what)
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"apt installs system packages now: {packages} ({why}). NO_APT=1 refuses.\n"
    assert machine.apt == ["apt-get -q update", f"apt-get -qy install --no-install-recommends {packages}"]


@pytest.mark.parametrize(("what", "packages"), [("venv", "python3.11-venv"), ("gl", "libegl1 libgl1 libgl1-mesa-dri")])
def test_apt_is_refused(machine: Machine, what: str, packages: str) -> None:
    done = machine.run(what, NO_APT="1")
    assert done.returncode == 1
    assert f"NO_APT=1: not installed with apt: {packages}" in done.stdout
    assert f"sudo apt-get install {packages}" in done.stderr
    assert machine.apt == []


def test_without_apt_tests_are_skipped_and_nothing_fails(machine: Machine) -> None:
    done = machine.run("test", NO_APT="1")
    assert done.returncode == 0
    assert machine.apt == []
    assert "not installed with apt: xvfb" in done.stdout
    assert "note: libosmesa6" in done.stdout


def test_what_is_there_is_not_installed(machine: Machine) -> None:
    (machine.log.parent / "log.done").touch()
    for what in ("venv", "gl"):
        done = machine.run(what)
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert machine.apt == []


def test_an_apt_that_fails_ends_with_what_to_do(machine: Machine) -> None:
    done = machine.run("gl", APT_FAILS="1")
    assert done.returncode == 1
    assert "sudo apt-get install libegl1 libgl1 libgl1-mesa-dri" in done.stderr
