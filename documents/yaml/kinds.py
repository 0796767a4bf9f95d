"""Which kind of file it is, by the keys that tell."""

from __future__ import annotations

from types import MappingProxyType
from typing import Any, Literal

from documents.findings import Finding
from documents.yaml.source import YamlSource

Kind = Literal["experiment", "display", "verification", "camera", "regions", "rig", "recipe"]

# The first key that is there tells.
TELLING = MappingProxyType(
    {
        "blocks": "experiment",
        "modes": "display",
        "onset_error_ms": "verification",
        "onsets": "verification",
        "matrix_XYZ_cd_m2": "camera",
        "regions": "regions",
        "mode": "rig",
        "kind": "recipe",
    }
)
_CALLED = MappingProxyType(
    {
        "experiment": "an experiment",
        "display": "a display file",
        "verification": "a photodiode's record",
        "camera": "a camera file",
        "regions": "a file of areas to compare",
        "rig": "a rig file",
        "recipe": "a recipe or observers file",
    }
)
# What only a file of the wanted kind has: with it, it is that kind, and has faults.
_OWN = MappingProxyType({"rig": ("display",), "recipe": ("kind",)})
_WANTED = MappingProxyType({**_CALLED, "recipe": "a recipe"})


def wrong_kind(source: YamlSource, wanted: Kind) -> Finding | None:
    """Return that a file is of another kind than ``wanted``, where its keys tell; else None."""
    data: Any = source.data
    if not isinstance(data, dict):
        return None
    own = _OWN.get(wanted) or tuple(key for key, kind in TELLING.items() if kind == wanted)
    key = next((key for key in TELLING if key in data), None)
    if key is None or TELLING[key] == wanted or any(one in data for one in own):
        return None
    place = source.place((key,), key=True)
    what = f"this is {_CALLED[TELLING[key]]}, not {_WANTED[wanted]}"
    remedy = f"{_WANTED[wanted]} has '{own[0]}:'; check the path"
    return Finding(what, source.file, place.line if place else None, place.column if place else None, remedy)
