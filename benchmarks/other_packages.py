"""What extensions of others cost at the start: none beside ours, 200 broken ones, and what looks through them all.

Each start is a process of its own. NumPy alone is the measure, as it is most of what a command that computes imports.
The error column has no meaning here.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

from curves import program, seconds, sized, times_faster
from promises import Promise

from documents.extensions import Environment
from tests.stress.broken_extensions import install_broken

ROOT = Path(__file__).parents[1]
RIG = str(ROOT / "configs/rigs/asus_vg248qe_3dvision.yaml")
# Reads a display file, whose curves are of kinds that packages may add.
WORDS = ["-m", "cyclopean", "display", "patches", RIG, "--list"]
NUMBER = 200


def _started(words: list[str], place: Path, *sites: Path) -> None:
    # Compiled files are kept, as an installation keeps them.
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    environment |= {
        "PYTHONPATH": os.pathsep.join(map(str, (ROOT, *sites))),
        "PYTHONPYCACHEPREFIX": str(place / "compiled"),
    }
    environment |= {"XDG_CACHE_HOME": str(place / f"known-{len(sites)}")}
    subprocess.run([sys.executable, *words], capture_output=True, check=True, cwd=place, env=environment)


def run() -> dict[str, object]:
    """Time the starts in turn, and a look through the environment."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        install_broken(place / "site", NUMBER)
        numpy = partial(_started, ["-c", "import numpy"], place)
        ours = partial(_started, WORDS, place)
        beside = partial(_started, WORDS, place, place / "site")
        rows: list[dict[str, object]] = [
            {"series": name, "parameter": "whole process", "seconds": seconds(work, repeats=3), "error": None}
            for name, work in (("import numpy", numpy), ("ours alone", ours), (f"{NUMBER} broken ones", beside))
        ]
        for name, path in (("ours alone", None), (f"{NUMBER} broken ones", [*sys.path, str(place / "site")])):
            taken = seconds(Environment(path).scan, repeats=3)
            rows.append({"series": name, "parameter": "looking through all", "seconds": taken, "error": None})
        rounds = sized(9, 1)
        beside_numpy, beside_ours = (
            1 / times_faster(one, other, rounds=rounds) for one, other in ((ours, numpy), (beside, ours))
        )
        promises = [
            Promise("display patches beside import numpy", beside_numpy, None, "ratio", unit="×"),
            Promise(f"the same with {NUMBER} broken extensions", beside_ours, 1.2, "ratio", unit="×"),
        ]
    return {"title": "Extensions at the start", "rows": rows, "promises": promises}


if __name__ == "__main__":
    program("other_packages", run)
