"""A release has one version everywhere, and nothing is made where a part of it is missing."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import pytest
import yaml

from tests.packaging.test_supply import ROOT, tool

RELEASE = tool("release")


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A repository whose version 1.2.0 is ready."""
    (tmp_path / "benchmarks").mkdir()
    (tmp_path / "pyproject.toml").write_text('[project]\nversion = "1.2.0"\n')
    (tmp_path / "CITATION.cff").write_text("version: 1.2.0\n")
    (tmp_path / "CHANGELOG.md").write_text("# Changelog\n\n## 1.2.0\n\n- All.\n")
    (tmp_path / "benchmarks" / "history.jsonl").write_text(json.dumps({"version": "1.2.0"}) + "\n")
    for words in (["init", "-q"], ["add", "-A"], ["commit", "-qm", "All"]):
        who = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
        subprocess.run(["git", *who, *words], cwd=tmp_path, check=True)
    return tmp_path


def test_a_version_that_is_ready_misses_nothing(checkout: Path) -> None:
    assert list(RELEASE.missing(checkout)) == []


@pytest.mark.parametrize(
    ("file", "text", "named"),
    [
        ("CITATION.cff", "version: 1.1.0\n", "CITATION.cff"),
        ("CHANGELOG.md", "## 1.2.0.1\n", "CHANGELOG.md"),
        ("CHANGELOG.md", "## Unreleased\n\n## 1.2.0\n", "not all is committed"),
        ("benchmarks/history.jsonl", '{"version": "1.1.0"}\n', "bench-release"),
    ],
)
def test_each_part_that_is_missing_is_named(checkout: Path, file: str, text: str, named: str) -> None:
    (checkout / file).write_text(text)
    assert any(named in problem for problem in RELEASE.missing(checkout))


def test_a_version_is_released_once(checkout: Path) -> None:
    subprocess.run(["git", "tag", "v1.2.0"], cwd=checkout, check=True)
    assert [problem for problem in RELEASE.missing(checkout) if "v1.2.0" in problem]


def test_workflows_call_what_people_run() -> None:
    text = "".join(file.read_text() for file in sorted((ROOT / ".github" / "workflows").glob("*.yml")))
    sessions = set(re.findall(r"def (\w+)\(session", (ROOT / "noxfile.py").read_text()))
    targets = set(re.findall(r"(?m)^([a-z-]+):", (ROOT / "Makefile").read_text()))
    assert set(re.findall(r"nox -s (\w+)", text)) <= sessions
    called = {word for line in re.findall(r"run: make ([a-z -]+)", text) for word in line.split()}
    assert called
    assert called <= targets
    for file in sorted((ROOT / ".github").rglob("*.yml")):
        assert isinstance(yaml.safe_load(file.read_text()), dict)
