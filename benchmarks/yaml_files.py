"""YAML files: read with the place of each value, by libyaml's parser and PyYAML's own; and one key changed by place.

The change stands beside reading and writing the whole file with PyYAML.
"""

from __future__ import annotations

import difflib
from functools import partial
from pathlib import Path
from unittest import mock

import numpy as np
import yaml
from curves import program, row, seconds, sized, times_faster
from promises import Promise, worst

from devices.characterise.mode_file import set_keys
from devices.display.curves import TableCurve
from devices.display.model import DisplayModel
from devices.display.model_spec import ModelSpec
from documents.yaml.source import YamlSource, parse_yaml

CONFIGS = Path(__file__).parents[1] / "configs"
BLOCK = ["source: measured again"]


def reading() -> dict[str, object]:
    """Read shipped files and one of 500 stimuli; the error is how many values or places differ from PyYAML's own."""
    files = ["displays/asus_vg248qe.yaml", "stimuli/paints.yaml", "observers/figure_4_14.yaml"]
    texts = {file: (CONFIGS / file).read_text(encoding="utf-8") for file in sized(files, files[:1])}
    stimuli = "".join(f"  s{number}: {{score: {number / 7:.4f}}}\n" for number in range(sized(500, 50)))
    texts["many stimuli"] = f"schema_version: 1\nkind: bradley_terry\nstimuli:\n{stimuli}"
    rows, ratios = [], []
    for name, text in texts.items():
        ways = {
            "libyaml, with places": partial(parse_yaml, text, name),
            "PyYAML's own parser, with places": partial(_slow, text, name),
            "yaml.safe_load, without places": partial(yaml.safe_load, text),
        }
        for series, way in ways.items():
            error = _differences(text, name) if series.startswith("libyaml") else 0
            rows.append(row(series, f"{name}, {len(text) / 1000:.1f} kB", seconds(way), error))
        ratios.append(times_faster(ways["libyaml, with places"], ways["PyYAML's own parser, with places"]))
    promises = [
        Promise("values and places that differ", worst(rows), 0, "count", "exactly"),
        Promise("libyaml before PyYAML's own parser, the least", min(ratios), 3, "ratio", "at least", "×"),
    ]
    return {"title": "YAML files: run time against values and places that differ", "rows": rows, "promises": promises}


def _slow(text: str, name: str) -> YamlSource:
    with mock.patch.object(yaml, "__with_libyaml__", False):
        return parse_yaml(text, name)


def _differences(text: str, name: str) -> int:
    quick, slow = parse_yaml(text, name), _slow(text, name)
    places = sum(
        one.get(path) != other.get(path)
        for one, other in ((quick.keys, slow.keys), (quick.values, slow.values))
        for path in {*one, *other}
    )
    return places + (repr(quick.data) != repr(slow.data))


def change_of_a_key() -> dict[str, object]:
    """Time both on files of 2, 10 and 50 modes; the error is how many lines differ that were not to be changed."""
    rows = []
    for modes in sized((2, 10, 50), (2,)):
        text = _file(modes)
        for series, change in (("by place", _by_place), ("PyYAML, whole", _whole)):
            changed = sum(
                line[:2] in ("- ", "+ ") for line in difflib.ndiff(text.split("\n"), change(text).split("\n"))
            )
            taken_s = seconds(partial(change, text), repeats=3)
            note = f"{len(text.splitlines())} lines"
            rows.append(row(series, f"{modes} modes", taken_s, max(0, changed - 2), note=note))
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
    program("yaml_files", reading, change_of_a_key)
