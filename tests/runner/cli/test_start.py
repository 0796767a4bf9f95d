"""What each command imports: of the heavy libraries those that it needs, and no others."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

Study = Any  # tests/conftest.py

HEAVY = {
    *("PIL", "colour", "cv2", "dask", "distributed", "glfw", "jinja2", "matplotlib", "moderngl", "numpy", "pandas"),
    *("pydantic", "rawpy", "rich", "scipy", "scipy.optimize", "scipy.stats", "skimage", "spectral", "yaml"),
}
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
    geometry = ["--sensor-mm", "36x24", "--pixels", "7360x4912", "--focal-mm", "105", "--distance-mm", "700"]
    reader = {"numpy", "pydantic", "yaml"}
    allowed = {
        ("completion", "bash"): set[str](),
        ("camera", "geometry", *geometry): {"numpy"},
        ("scores", str(table)): {"numpy", "rich", "scipy"},
        ("schema", "experiment"): reader,
        ("display", "new", *new): reader,
        ("check", str(study.experiment)): reader | {"PIL", "rich"},
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
