"""YAML files read with the place of each value: by libyaml's parser, and by PyYAML's own."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from unittest import mock

import yaml
from curves import program, seconds, sized, times_faster
from promises import Promise, worst

from documents.yaml.source import YamlSource, parse_yaml

CONFIGS = Path(__file__).parents[1] / "configs"


def run() -> dict[str, object]:
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
            rows.append(
                {
                    "series": series,
                    "parameter": f"{name}, {len(text) / 1000:.1f} kB",
                    "seconds": seconds(way),
                    "error": _differences(text, name) if series.startswith("libyaml") else 0,
                }
            )
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


if __name__ == "__main__":
    program("yaml_files", run)
