"""The scripts and the notebook in examples/ run, and print what they are for."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

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


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """An environment with one cache of stimuli for all examples."""
    cache = tmp_path_factory.mktemp("cache")
    return {**os.environ, "CYCLOPEAN_CACHE": str(cache), "PYTHONPATH": str(ROOT), "TMPDIR": str(cache)}


def test_every_script_is_run() -> None:
    assert {file.name for file in EXAMPLES.glob("*.py")} == set(PRINTS)


@pytest.mark.parametrize("script", sorted(PRINTS))
def test_script(script: str, environment: dict[str, str], tmp_path: Path) -> None:
    command = [sys.executable, str(EXAMPLES / script)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=tmp_path, timeout=300)
    assert done.returncode == 0, done.stderr
    assert PRINTS[script] in done.stdout


def test_notebook(environment: dict[str, str]) -> None:
    cells = json.loads((EXAMPLES / "first_look.ipynb").read_text(encoding="utf-8"))["cells"]
    assert all(not cell.get("outputs") for cell in cells)
    code = "\n".join("".join(cell["source"]) + "\n" for cell in cells if cell["cell_type"] == "code")
    shown = code + "\nprint(len(trials), frame['score'].sum())\n"
    command = [sys.executable, "-c", shown]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=ROOT, timeout=300)
    assert done.returncode == 0, done.stderr
    count, total = done.stdout.split()[-2:]
    assert int(count) == 8 * 46
    assert float(total) == pytest.approx(1.0)
