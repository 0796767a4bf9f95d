"""Results as plain values for JSON."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from documents.text import JsonResult, json_value


@dataclass(frozen=True, slots=True)
class Fit(JsonResult):
    theta: Any
    inner: Any
    shared: float
    json_keys: ClassVar = {"theta": "strengths", "shared": None, "inner.name": "name"}
    json_also: ClassVar = ("inner.name",)


def test_fields_come_by_name_and_properties_after_them() -> None:
    fit = Fit(np.array([1.5, np.nan]), Path("x") / "y", 3.0)
    assert list(fit.to_json().items()) == [("strengths", [1.5, None]), ("inner", str(Path("x/y"))), ("name", "y")]
    several = {"x": (fit, None, np.float64(np.inf), np.int64(4), True)}
    assert json_value(several) == {"x": [fit.to_json(), None, None, 4, True]}
