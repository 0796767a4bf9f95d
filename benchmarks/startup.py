"""How soon the help text appears, beside the least that any click program takes."""

from __future__ import annotations

import subprocess
import sys
from functools import partial

from curves import program, seconds, sized, times_faster
from promises import Promise

PROGRAMS = {
    "cyclopean --help": "import sys; sys.argv = ['cyclopean', '--help']; from runner.cli.main import main; main()",
    "import click": "import click",
}


def _started(code: str) -> None:
    subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)


def run() -> dict[str, object]:
    """Time both programs in turn; the error column has no meaning here."""
    rows = []
    for name, code in PROGRAMS.items():
        taken = seconds(partial(_started, code), repeats=3)
        rows.append({"series": name, "parameter": "whole process", "seconds": taken, "error": None})
    ours, click = (partial(_started, code) for code in PROGRAMS.values())
    ratio = 1 / times_faster(ours, click, rounds=sized(9, 1))
    promises = [Promise("cyclopean --help beside import click", ratio, 2.0, "ratio", unit="×")]
    return {"title": "Start-up", "rows": rows, "promises": promises}


if __name__ == "__main__":
    program("startup", run)
