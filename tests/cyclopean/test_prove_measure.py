"""What proves a measure: ours keep the promises, one that breaks a promise is found out; another package's is used."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from cyclopean.testing import BrokenPromiseError, prove_measure
from stimuli.errors import StimulusError
from stimuli.measures import MEASURES, ViewingConditions, measure_names, measure_pictures

MEASURE = """
import numpy as np
from stimuli.measures import EyeMeasured, MapMeasure

CYCLOPEAN_INTERFACE = 1

class Contrast(MapMeasure):
    name = "contrast"
    title = "contrast"
    unit = ""
    better = "lower"
    identical = 0.0
    source = "a test"
    symmetric = True

    def error_map(self, reference_XYZ, test_XYZ, viewing):
        pictures = (reference_XYZ, test_XYZ)
        first, second = (np.log(np.asarray(picture[:], np.float32)[..., 1] + 1) for picture in pictures)
        return abs(first - second)
"""
OTHERWISE = {
    "identical = 0.0": ("identical = 1.0", "identical pictures"),
    'better = "lower"': ('better = "higher"', "farther"),
    "abs(first - second)": ("abs(first - second) / first.max()", "exchanged"),
    "return abs": ("return np.arange(first.size, dtype='f4').reshape(first.shape) * abs", "mirrored"),
    "    def error_map": ("    def pooled(self, errors): return float(errors.sum())\n    def error_map", "size"),
    "picture[:], np.float32": ("picture, np.float32", "rows"),
    "+ 1)": ("+ 1, out=picture[..., 1] if isinstance(picture, np.ndarray) else None)", "stay"),
    "second)": ("second)[1:]", "map"),
    "+ 1": ("- first_light", "InputError"),
}


@pytest.mark.parametrize("name", measure_names(installed_only=True))
def test_ours_keep_the_promises(name: str) -> None:
    assert len(prove_measure(name)) >= 8


@pytest.mark.parametrize("old", OTHERWISE)
def test_a_broken_promise_is_found(old: str) -> None:
    new, said = OTHERWISE[old]
    text = MEASURE.replace(old, new)
    if said == "InputError":
        text = text.replace("- first_light", "- (0.0 if len(picture[:]) > 1 else [])")
    held: dict[str, type] = {}
    exec(text, held)
    with pytest.raises(BrokenPromiseError, match=said):
        prove_measure(held["Contrast"]())


def test_another_packages_measure_is_found_by_its_name_and_named(
    install: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(MEASURES, "_loaded", {})
    install("seen", MEASURE, "2.1", group=MEASURES.group, contrast="Contrast")
    install(
        "torn",
        MEASURE.replace("contrast", "torn").replace("return", "return 1 / 0,"),
        group=MEASURES.group,
        torn="Contrast",
    )
    assert prove_measure("contrast")
    grey = np.full((32, 32, 3), 40.0)
    viewing = ViewingConditions(45.0)
    table = measure_pictures(grey, 1.1 * grey, ["all"], viewing)
    assert table["contrast"].remarks == ("it is of seen 2.1",)
    assert "contrast: it is of seen 2.1" in table.remarks()
    assert "pu-psnr" in [row.measure.name for row in table.rows]
    assert any("torn" in remark and "ZeroDivisionError" in remark for remark in table.left_out)
    with pytest.raises(StimulusError, match=r"torn 1\.0"):
        measure_pictures(grey, grey, ["torn"], viewing)
