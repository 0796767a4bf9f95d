"""What each command imports: of the heavy libraries those that it needs, and no others."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.nightly
Study = Any  # tests/conftest.py

HEAVY = {
    *("PIL", "colour", "cv2", "dask", "distributed", "glfw", "jinja2", "matplotlib", "moderngl", "numpy", "pandas"),
    *("pydantic", "rawpy", "rich", "scipy", "scipy.optimize", "scipy.stats", "skimage", "spectral", "yaml"),
    # Of our own: the models of all kinds of blocks, of recipes and of records, and the page of the report.
    *("runner.protocol.experiment", "stimuli.recipes.files_recipe", "analysis.records.order", "analysis.report.page"),
}
STUDY = {"runner.protocol.experiment", "stimuli.recipes.files_recipe"}
RECORDED = Path(__file__).parents[1] / "recorded"
# One process loads the program and divides for each chain. Each step of a chain may import what those before it may, or
# more, so that it does not matter which of them imports it.
EACH = """
import contextlib, io, json, os, sys
from runner.cli.main import main

for chain in json.loads(sys.argv[1]):
    if not (child := os.fork()):
        for step in chain:
            said = io.StringIO()
            status = 0
            with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
                if isinstance(step, str):
                    exec(step)
                else:
                    sys.argv = ["cyclopean", *step]
                    try:
                        main()
                    except SystemExit as left:
                        status = left.code or 0
            print(json.dumps([status and said.getvalue(), sorted(sys.modules)]), flush=True)
        os._exit(0)
    os.waitpid(child, 0)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system cannot divide a process")
def test_no_heavy_library_is_imported_that_is_not_needed(study: Study, tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    table.write_text("winner,loser,count\n" + "".join(f"{a},{b},3\n" for a in "abc" for b in "abc" if a != b))
    new = ("-o", str(tmp_path / "new.yaml"), "--white-cd-m2", "120", "--panel", "1920x1080,0.2768")
    results = str(tmp_path / "results")
    shutil.copytree(RECORDED / "results", results)
    geometry = ["--sensor-mm", "36x24", "--pixels", "7360x4912", "--focal-mm", "105", "--distance-mm", "700"]
    few = ("--observers", "5", "--replicates", "5")
    reader = {"numpy", "pydantic", "yaml"}
    correlate = (
        "from extensions.agreement.correlations import KINDS, correlation\n"
        "import numpy as np\n"
        "[correlation(np.arange(5.0), np.arange(5.0), kind) for kind in KINDS]"
    )
    gamma = (
        "from devices.diagnostics.channels import simple_gamma\n"
        "import numpy as np\n"
        "simple_gamma(np.linspace(0.1, 1, 5), np.linspace(0.1, 1, 5) ** 2)"
    )
    # Commands, and Python that commands run.
    chains: list[list[tuple[Sequence[str], set[str]]]] = [
        [
            (("completion", "bash"), set()),
            (("stimuli", "contrast", "--help"), set()),
            (("camera", "geometry", *geometry), {"numpy"}),
            (gamma, {"numpy"}),
            (correlate, {"numpy", "pydantic"}),
            (("schema", "rig"), reader),
            (("display", "new", *new), reader),
            (("schema", "experiment"), reader | STUDY),
            ("import extensions.power.study, extensions.power; extensions.power.write_page", reader | STUDY),
            (("check", str(study.experiment)), reader | STUDY | {"PIL", "rich", "scipy"}),
            (("power", str(study.experiment), *few), reader | STUDY | {"PIL", "rich", "scipy"}),
        ],
        [
            (("verify", results), {"pydantic", "analysis.records.order"}),
            (("seal", results, "--replace"), {"pydantic", "analysis.records.order"}),
        ],
        [(("scores", str(table)), {"numpy", "rich", "scipy"})],
        [("import runner.check.doctor", reader | {"glfw"})],
        [("import runner.reports.results", reader | {"analysis.report.page"})],
    ]
    steps = json.dumps([[step for step, _ in chain] for chain in chains])
    done = subprocess.run([sys.executable, "-c", EACH, steps], capture_output=True, text=True, timeout=600)
    told = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(told) == sum(map(len, chains)), done.stderr
    for (step, allowed), (error, modules) in zip((one for chain in chains for one in chain), told, strict=True):
        assert not error, (step, error)
        assert HEAVY & set(modules) <= allowed, step
