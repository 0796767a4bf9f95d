"""Display files of absurd numbers: refused in a line, or a model of finite numbers, and soon."""

from __future__ import annotations

import json
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from devices.display import read_display
from documents import InputError

NUMBERS = (1e308, -1e308, 1e-308, float("nan"), float("inf"), 10**40, 0.0)
LIGHT: dict[str, Any] = {
    "black_XYZ_cd_m2": [0.1, 0.1, 0.1],
    "primaries_XYZ_cd_m2": {"red": [40.0, 21.0, 2.0], "green": [36.0, 72.0, 12.0], "blue": [18.0, 7.0, 95.0]},
}


def table() -> dict[str, Any]:
    return {"codes": [0.0, 0.5, 1.0], "light": [0.0, 0.2, 1.0]}


def plvc() -> dict[str, Any]:
    own = {
        name: {**table(), "XYZ_per_light_cd_m2": [light] * 4} for name, light in LIGHT["primaries_XYZ_cd_m2"].items()
    }
    return {"kind": "plvc", **own, "mixtures_XYZ_cd_m2": {"red_green": [-1.0, -1.0, 0.0]}}


def gog() -> dict[str, Any]:
    return {"kind": "gog", **{name: {"gain": 1.0, "offset": 0.0, "gamma": 2.2} for name in ("red", "green", "blue")}}


def tables() -> dict[str, Any]:
    return {"kind": "table", **{name: table() for name in ("red", "green", "blue")}}


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the paths of all numbers in ``value``."""
    if isinstance(value, dict | list):
        parts = value.items() if isinstance(value, dict) else enumerate(value)
        return [one for key, part in parts for one in places(part, (*path, key))]
    return [path] if isinstance(value, float) else []


def read(path: Path, mode: dict[str, Any]) -> None:
    document = {
        "schema_version": 1,
        "panel": {"resolution_px": [64, 48], "pixel_pitch_mm": 0.25},
        "modes": {"side-by-side": mode},
    }
    path.write_text(yaml.dump(document, Dumper=_NoAliases), encoding="utf-8")
    models = read_display(path).modes["side-by-side"]
    for eye in (models.left, models.right):
        codes = eye.code(np.array([[10.0, 10.0, 10.0]]))
        assert np.isfinite(codes).all()


class _NoAliases(yaml.SafeDumper):
    def ignore_aliases(self, data: Any) -> bool:
        return True


NIGHTLY = pytest.mark.nightly


@pytest.mark.parametrize("curve", [pytest.param(gog, marks=NIGHTLY), pytest.param(tables, marks=NIGHTLY), plvc])
def test_absurd_numbers_are_refused_or_harmless(tmp_path: Path, curve: Any) -> None:
    path = tmp_path / "d.yaml"
    wrong = []
    for place in places({**LIGHT, "curve": curve()})[:: 31 if curve is plvc else 9]:
        for number in NUMBERS:
            mode: Any = {"black_XYZ_cd_m2": list(LIGHT["black_XYZ_cd_m2"])}
            mode["primaries_XYZ_cd_m2"] = {name: list(one) for name, one in LIGHT["primaries_XYZ_cd_m2"].items()}
            mode["curve"] = json.loads(json.dumps(curve()))  # no list twice
            inner = mode
            for key in place[:-1]:
                inner = inner[key]
            inner[place[-1]] = number
            began_s = time.process_time()
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("error")
                    read(path, mode)
            except InputError as error:
                if not str(error).startswith(str(path)):
                    wrong.append((place, number, str(error)[:80]))
            except Exception as error:  # all that are wrong are told at once
                wrong.append((place, number, repr(error)[:80]))
            assert time.process_time() - began_s < 3
    assert not wrong, "\n".join(map(str, wrong))
