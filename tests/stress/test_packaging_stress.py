"""A full installation with all libraries, and whether each system has wheels of them; both ask the package index."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
import venv
from pathlib import Path

import pytest

pytestmark = [pytest.mark.stress, pytest.mark.alone]

ROOT = Path(__file__).parents[2]
# The tags that pip of that system takes, the newest first.
SYSTEMS = {
    "Windows": ["win_amd64"],
    "macOS on Apple's processors": [f"macosx_{version}_0_arm64" for version in (14, 13, 12, 11)]
    + [f"macosx_{version}_universal2" for version in ("11_0", "10_13", "10_9")],
    "Linux": [f"manylinux_2_{version}_x86_64" for version in (28, 27, 24, 17)] + ["manylinux2014_x86_64"],
}


def pip(*words: str, timeout_s: float = 1200) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "pip", "--disable-pip-version-check", *words]
    return subprocess.run(command, cwd=ROOT, capture_output=True, encoding="utf-8", timeout=timeout_s, check=False)


@pytest.fixture(scope="module", autouse=True)
def index() -> None:
    """Skip where there is no package index."""
    if pip("install", "--quiet", "--dry-run", "--no-deps", "--ignore-installed", "click").returncode:
        pytest.skip("no package index can be reached")


def pins(folder: Path) -> Path:
    """Return a file of the pinned versions without their hashes, which pip takes for the checkout's dependencies."""
    lines = (ROOT / "requirements/dev.txt").read_text(encoding="utf-8").splitlines()
    file = folder / "pins.txt"
    file.write_text("\n".join(line.rstrip(" \\") for line in lines if "==" in line), encoding="utf-8")
    return file


@pytest.mark.parametrize("python", ["3.11", "3.13"])
@pytest.mark.parametrize("system", SYSTEMS)
def test_every_library_has_a_wheel(system: str, python: str, tmp_path: Path) -> None:
    """With the pinned versions, so that nobody needs a compiler."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    tags = [word for tag in SYSTEMS[system] for word in ("--platform", tag)]
    options = ["--dry-run", "--ignore-installed", "--target", str(tmp_path), "--only-binary=:all:"]
    chosen = ["--python-version", python, "--implementation", "cp", "--constraint", str(pins(tmp_path))]
    done = pip("install", *options, *tags, *chosen, *project["dependencies"])
    assert done.returncode == 0, done.stderr[-2000:]


def test_the_demonstration_runs_after_a_full_installation(tmp_path: Path) -> None:
    """`pip install` of the checkout with all that it needs, and the demonstration in an empty folder."""
    environment, empty = tmp_path / "environment", tmp_path / "empty"
    venv.create(environment, with_pip=True)
    programs = environment / ("Scripts" if os.name == "nt" else "bin")
    own = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    own |= {"PIP_CONSTRAINT": str(pins(tmp_path)), "CYCLOPEAN_CACHE": str(tmp_path / "cache")}
    install = [str(programs / "python"), "-m", "pip", "install", "--quiet", str(ROOT)]
    done = subprocess.run(install, capture_output=True, encoding="utf-8", env=own, timeout=1800, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    empty.mkdir()
    demo = [str(programs / "cyclopean"), "demo"]
    told = subprocess.run(demo, cwd=empty, capture_output=True, encoding="utf-8", env=own, timeout=600, check=False)
    assert told.returncode == 0, told.stderr[-2000:]
    assert (empty / told.stdout.split("The report: ")[1].strip()).is_file()
