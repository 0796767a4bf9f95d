"""The scripts and the notebook in examples/ run, and print what they are for."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

pytestmark = pytest.mark.nightly

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
PRINTS = {
    "ask_a_display.py": "and back: [0.5 0.5 0.5]",
    "car_paint_beside_a_screen.py": "quantum dots or lasers  matched for CIE 2015 10: ΔE00 median 0.8",
    "compare_two_pictures.py": "one a tenth too bright: not validated",
    "contrast_threshold.py": "of 3 observers, who see 0.03 by half",
    "measures_and_observers.py": "to 1.00), agrees",
    "plan_observers.py": "80 % power",
    "score_a_table.py": "0.640",
    "simulate_a_study.py": "460 trials by 10 observers",
    "ten_photographs.py": "ten pairs",
}
AS_PROCESS = "plan_observers.py"  # what computes in further processes is imported there as the main program
# What stands in a script, what stands there in a quick run, and what that prints. As shipped: make stress.
SMALLER = {
    "measures_and_observers.py": ("12, results=", "6, results=", "to 1.00), agrees"),
    "simulate_a_study.py": ("observers=10", "observers=3", "138 trials by 3 observers"),
    "ten_photographs.py": ("SIZE_PX = 1200, 800", "SIZE_PX = 150, 100", "ten pairs of 150 x 100"),
}


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One cache of stimuli for all examples, and the folder of their temporary ones."""
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(autouse=True)
def environment(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a new process would have: that cache, and numbers printed as numpy does by itself."""
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(cache))
    monkeypatch.setenv("TMPDIR", str(cache))
    monkeypatch.setattr("tempfile.tempdir", str(cache))
    np.set_printoptions(legacy=False)  # colour-science, where another test imported it, asks for an old style


def test_every_script_is_run() -> None:
    assert {file.name for file in EXAMPLES.glob("*.py")} == set(PRINTS)


@pytest.mark.parametrize("script", sorted(set(PRINTS) - {AS_PROCESS}))
def test_script(
    script: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (EXAMPLES / script).read_text(encoding="utf-8")
    shipped, smaller, prints = SMALLER.get(script, ("", "", PRINTS[script]))
    assert not shipped or text.count(shipped) == 1
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", [script])
    code = compile(text.replace(shipped, smaller) if shipped else text, str(EXAMPLES / script), "exec")
    exec(code, {"__name__": "__main__", "__file__": str(EXAMPLES / script)})
    assert prints in capsys.readouterr().out


@pytest.mark.parametrize(
    "script",
    [pytest.param(name, marks=() if name == AS_PROCESS else pytest.mark.stress) for name in sorted(PRINTS)],
)
def test_script_as_a_process(script: str, tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, str(EXAMPLES / script)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=tmp_path, timeout=300)
    assert done.returncode == 0, done.stderr
    assert PRINTS[script] in done.stdout


@pytest.mark.parametrize("observers", [3, pytest.param(8, marks=pytest.mark.stress)])
def test_notebook(observers: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """With fewer observers in a quick run."""
    cells = json.loads((EXAMPLES / "first_look.ipynb").read_text(encoding="utf-8"))["cells"]
    assert all(not cell.get("outputs") for cell in cells)
    code = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
    assert code.count("observers=8") == 1
    monkeypatch.chdir(ROOT)
    names: dict[str, object] = {"__name__": "__main__"}
    exec(compile(code.replace("observers=8", f"observers={observers}"), "first_look.ipynb", "exec"), names)
    trials, frame = names["trials"], names["frame"]
    assert isinstance(trials, pd.DataFrame)
    assert isinstance(frame, pd.DataFrame)
    assert len(trials) == observers * 46
    assert float(frame["score"].sum()) == pytest.approx(1.0)
