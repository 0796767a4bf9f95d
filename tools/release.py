#!/usr/bin/env python3
"""Make a release of what is committed: wheel, source archive and list of packages in dist/, and the tag.

    python tools/release.py --check    say what is missing, and make nothing
    python tools/release.py            make it; exit status 1 where something is missing

A release has one version: in pyproject.toml, in CITATION.cff, as a heading of CHANGELOG.md, and as a line of
benchmarks/history.jsonl, which `make bench-release` writes. Nothing is sent anywhere: who releases pushes the tag.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[1]


def version_of(root: Path) -> str:
    """Return the version in pyproject.toml."""
    return str(tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"])


def missing(root: Path) -> Iterator[str]:
    """Yield what a release of the checkout at ``root`` still needs, each with what to do."""
    version = version_of(root)
    cited = yaml.safe_load((root / "CITATION.cff").read_text(encoding="utf-8"))["version"]
    if str(cited) != version:
        yield f"CITATION.cff is of version {cited}: write {version}"
    if not re.search(rf"(?m)^## {re.escape(version)}(?: |$)", (root / "CHANGELOG.md").read_text(encoding="utf-8")):
        yield f"CHANGELOG.md has no heading '## {version}': write what a user meets"
    lines = (root / "benchmarks" / "history.jsonl").read_text(encoding="utf-8").splitlines()
    if not any(json.loads(line).get("version") == version for line in lines):
        yield f"benchmarks/history.jsonl has no line of {version}: run make bench-release"
    if _git(root, "status", "--porcelain"):
        yield "not all is committed: commit it"
    if _git(root, "tag", "--list", f"v{version}"):
        yield f"there is a tag v{version}: raise the version in pyproject.toml"


def _git(root: Path, *words: str) -> str:
    return subprocess.run(["git", *words], cwd=root, check=True, capture_output=True, text=True).stdout.strip()


def main() -> int:
    """Say what is missing; where nothing is, make the release."""
    problems = list(missing(ROOT))
    for problem in problems:
        print(problem, file=sys.stderr)
    if problems or sys.argv[1:] == ["--check"]:
        return int(bool(problems))
    subprocess.run([sys.executable, "-m", "hatchling", "build", "-d", "dist"], cwd=ROOT, check=True)
    (ROOT / "sbom.json").replace(ROOT / "dist" / "sbom.json")
    tag = f"v{version_of(ROOT)}"
    _git(ROOT, "tag", "-a", tag, "-m", f"cyclopean {tag}")
    print(f"dist/ holds {tag}; push the tag: git push origin {tag}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
