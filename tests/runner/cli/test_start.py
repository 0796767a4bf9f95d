"""What each command imports: of the heavy libraries those that it needs, and no others."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

Study = Any  # tests/conftest.py

HEAVY = {
    *("PIL", "colour", "cv2", "dask", "distributed", "glfw", "jinja2", "matplotlib", "moderngl", "numpy", "pandas"),
    *("pydantic", "rawpy", "rich", "scipy", "scipy.optimize", "scipy.stats", "skimage", "spectral", "yaml"),
    # Of our own: the models of all kinds of blocks, of recipes and of records, and the page of the report.
    *("runner.protocol.experiment", "stimuli.recipes.recipe", "analysis.records.order", "analysis.report.page"),
}
STUDY = {"runner.protocol.experiment", "stimuli.recipes.recipe"}
RECORDED = Path(__file__).parents[1] / "recorded"
# One process loads the program and divides for each command, which then imports only what is its own.
EACH = """
import contextlib, io, json, os, sys
from runner.cli.main import main
found = {}
for name, words in json.loads(sys.argv[1]).items():
    read, write = os.pipe()
    if not os.fork():
        sys.argv = ["cyclopean", *words]
        said = io.StringIO()
        status = 0
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            try:
                main()
            except SystemExit as left:
                status = left.code or 0
        os.write(write, json.dumps([status and said.getvalue(), sorted(sys.modules)]).encode())
        os._exit(0)
    os.close(write)
    with os.fdopen(read) as pipe:
        found[name] = json.load(pipe)
    os.wait()
print(json.dumps(found))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system cannot divide a process")
def test_a_command_imports_no_heavy_library_that_it_does_not_need(study: Study, tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    table.write_text("winner,loser,count\n" + "".join(f"{a},{b},3\n" for a in "abc" for b in "abc" if a != b))
    new = ("-o", str(tmp_path / "new.yaml"), "--white-cd-m2", "120", "--panel", "1920x1080,0.2768")
    results = tmp_path / "results"
    shutil.copytree(RECORDED / "results", results)
    geometry = ["--sensor-mm", "36x24", "--pixels", "7360x4912", "--focal-mm", "105", "--distance-mm", "700"]
    reader = {"numpy", "pydantic", "yaml"}
    allowed = {
        ("completion", "bash"): set[str](),
        ("camera", "geometry", *geometry): {"numpy"},
        ("scores", str(table)): {"numpy", "rich", "scipy"},
        ("schema", "experiment"): reader | STUDY,
        ("schema", "rig"): reader,
        ("verify", str(results)): {"pydantic", "analysis.records.order"},
        ("seal", str(results), "--replace"): {"pydantic", "analysis.records.order"},
        ("display", "new", *new): reader,
        ("check", str(study.experiment)): reader | STUDY | {"PIL"},
    }
    commands = {" ".join(words[:2]): words for words in allowed}
    done = subprocess.run(
        [sys.executable, "-c", EACH, json.dumps(commands)], capture_output=True, text=True, check=True, timeout=600
    )
    found = json.loads(done.stdout)
    for name, words in commands.items():
        error, modules = found[name]
        assert not error, (name, error)
        assert HEAVY & set(modules) <= allowed[words], name


@pytest.mark.parametrize(
    ("code", "allowed"),
    [
        ("import runner.check.doctor", {"glfw", "numpy", "pydantic", "yaml"}),
        ("import runner.reports.results", {"numpy", "pydantic", "yaml", "analysis.report.page"}),
        (
            "import runner.reports.power, analysis.power; analysis.power.write_page",
            {"numpy", "pydantic", "yaml", *STUDY},
        ),
        (
            "from analysis.agreement.correlations import KINDS, correlation\n"
            "import numpy as np\n"
            "[correlation(np.arange(5.0), np.arange(5.0), kind) for kind in KINDS]",
            {"numpy", "pydantic"},
        ),
        (
            "from devices.diagnostics.channels import simple_gamma\n"
            "import numpy as np\n"
            "simple_gamma(np.linspace(0.1, 1, 5), np.linspace(0.1, 1, 5) ** 2)",
            {"numpy"},
        ),
    ],
)
def test_what_a_command_works_with_imports_no_heavy_library_that_it_does_not_need(code: str, allowed: set[str]) -> None:
    command = [sys.executable, "-c", f"{code}\nimport json, sys\nprint(json.dumps(sorted(sys.modules)))"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert HEAVY & set(json.loads(done.stdout)) <= allowed
