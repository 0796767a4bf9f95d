"""Tests pass wherever they are started: in a shell's background, and in a checkout with nothing beside it."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.mark.skipif(sys.platform == "win32", reason="a shell of Windows leaves Ctrl-C as it is in the background")
def test_ctrl_c_is_heard_where_the_shell_ignores_it() -> None:
    """A shell without job control starts what runs in its background deaf to Ctrl-C, and every child inherits that."""
    deaf = (
        "import signal, sys, pytest; signal.signal(signal.SIGINT, signal.SIG_IGN); sys.exit(pytest.main(sys.argv[1:]))"
    )
    named = f"{Path(__file__).relative_to(ROOT)}::test_ctrl_c_ends_a_program"
    words = ["-q", "-p", "no:cacheprovider", named]
    done = subprocess.run([sys.executable, "-c", deaf, *words], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


@pytest.mark.skipif(sys.platform == "win32", reason="Windows sends no SIGINT to one process")
def test_ctrl_c_ends_a_program() -> None:
    code = "import time; print('ready', flush=True); time.sleep(60)"
    program = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    assert program.stdout is not None
    with program.stdout:
        assert program.stdout.readline().strip() == b"ready"
        program.send_signal(signal.SIGINT)
        assert program.wait(30) == -signal.SIGINT


def test_no_test_reads_beside_the_checkout() -> None:
    """What a test needs from there it takes from the fixture `shared_data`, for which somebody names the folder."""
    climbs = re.compile(r"\(__file__\)(?:\.resolve\(\))?\.parents\[(\d+)\]")
    found = []
    for file in sorted((ROOT / "tests").rglob("*.py")):
        text, above = file.read_text(encoding="utf-8"), len(file.relative_to(ROOT).parents)
        past = [climb[0] for climb in climbs.finditer(text) if int(climb[1]) >= above]
        past += [word for word in ("ROOT.parent", "ROOT / " + '".."') if word in text and file != Path(__file__)]
        found += [f"{file.relative_to(ROOT)}: {word}" for word in past]
    assert not found
