"""200 packages that are wrong: what is done without them is done as before, and `doctor` names each once."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from analysis.records import read_session, session_files
from documents.text import visible
from runner.check import REGISTRIES
from tests.stress.broken_extensions import GROUPS, install_broken

pytestmark = pytest.mark.stress
Study = Any  # tests/conftest.py
ROOT = Path(__file__).parents[2]


def _run(words: Sequence[object], folder: Path, *sites: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (ROOT, *sites)))}
    environment |= {"XDG_CACHE_HOME": str(folder / f"known-{len(sites)}")}
    command = [sys.executable, "-m", "cyclopean", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder, env=environment)


def test_wrong_extensions_leave_everything_as_it_was(study: Study) -> None:
    assert {f"cyclopean.{group}" for group in GROUPS} == {registry.group for registry in REGISTRIES}
    names = install_broken(study.folder / "site")
    (study.folder / "table.csv").write_text("winner,loser,count\na,b,30\nb,a,10\n")
    session = ["run", study.experiment, "--observer", "01", "--simulate", study.observers, "--results"]
    check = ["check", study.experiment, "--no-screen"]
    same = (["--help"], ["scores", "table.csv"], ["scores", "table.csv", "--model", "davidsn"], check)
    for words in (*same, ["schema", "experiment"]):
        without, beside = (_run(words, study.folder, *sites) for sites in ((), (study.folder / "site",)))
        assert (beside.returncode, beside.stdout) == (without.returncode, without.stdout), words
    answers = []
    for results, sites in ((study.results, ()), (study.folder / "others", (study.folder / "site",))):
        assert _run([*session, results], study.folder, *sites).returncode == 0
        answers.append([trial.details() for trial in read_session(next(session_files(results))).trials])
    assert answers[0] == answers[1]
    told = json.loads(_run(["doctor", "--json"], study.folder, study.folder / "site").stdout)["extensions"]
    assert sorted(package.split()[0] for package in told) == sorted(names)
    assert {len(faults) for faults in told.values()} == {1}
    lines = [f"{package} {faults[0]}" for package, faults in told.items()]
    assert all(len(line) < 1000 and line == visible(line) and "cannot be used" in line for line in lines)
