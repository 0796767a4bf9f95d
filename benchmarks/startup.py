"""How soon the help text appears, beside the least that any click program takes."""

from __future__ import annotations

import subprocess
import sys

from curves import seconds, write

PROGRAMS = {
    "cyclopean --help": "import sys; sys.argv = ['cyclopean', '--help']; from runner.cli.main import main; main()",
    "import click": "import click",
}


def run() -> dict[str, object]:
    """Time both programs in turn; the error column has no meaning here."""
    rows = []
    for name, code in PROGRAMS.items():
        command = [sys.executable, "-c", code]
        taken = seconds(lambda command=command: subprocess.run(command, capture_output=True, check=True))
        rows.append({"series": name, "parameter": "whole process", "seconds": taken, "error": None})
    rows[0]["note"] = f"{rows[0]['seconds'] / rows[1]['seconds']:.2f} × import click; the limit is 2"
    return {"title": "Start-up", "rows": rows}


if __name__ == "__main__":
    result = run()
    write("startup", str(result["title"]), result["rows"])
    print(result["rows"][0]["note"])
