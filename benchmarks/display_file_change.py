"""One key of a display file changed: by place, and by reading and writing the whole file with PyYAML."""

from __future__ import annotations

import difflib
from functools import partial

import numpy as np
import yaml
from curves import program, seconds, sized
from promises import Promise, worst

from devices.characterise.mode_file import set_keys
from devices.display.curves import TableCurve
from devices.display.model import DisplayModel
from devices.display.model_spec import ModelSpec

BLOCK = ["source: measured again"]


def run() -> dict[str, object]:
    """Time both on files of 2, 10 and 50 modes; the error is how many lines differ that were not to be changed."""
    rows = []
    for modes in sized((2, 10, 50), (2,)):
        text = _file(modes)
        for series, change in (("by place", _by_place), ("PyYAML, whole", _whole)):
            changed = sum(
                line[:2] in ("- ", "+ ") for line in difflib.ndiff(text.split("\n"), change(text).split("\n"))
            )
            rows.append(
                {
                    "series": series,
                    "parameter": f"{modes} modes",
                    "seconds": seconds(partial(change, text), repeats=3),
                    "error": max(0, changed - 2),
                    "note": f"{len(text.splitlines())} lines",
                }
            )
    promises = [Promise("other lines that differ", worst(rows, series="by place"), 0, "count", "exactly")]
    title = "A key of a display file changed: run time against lines lost"
    return {"title": title, "rows": rows, "promises": promises}


def _file(modes: int) -> str:
    codes = tuple(np.linspace(0, 1, 18).tolist())
    model = DisplayModel(np.zeros(3), np.diag([1.0, 2.0, 3.0]), (TableCurve(codes, tuple(c**2 for c in codes)),) * 3)
    block = "".join(f"    {line}\n" for line in ModelSpec.of(model, source="measured").lines())
    return "modes:   # all\n" + "".join(f"  mode{number}:   # the {number}th\n{block}" for number in range(modes))


def _by_place(text: str) -> str:
    return set_keys(text, ("modes", "mode1"), {"source": BLOCK}, "display.yaml")[0]


def _whole(text: str) -> str:
    data = yaml.safe_load(text)
    data["modes"]["mode1"]["source"] = "measured again"
    told: str = yaml.safe_dump(data, sort_keys=False)
    return told


if __name__ == "__main__":
    program("display_file_change", run)
