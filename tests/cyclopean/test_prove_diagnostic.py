"""What proves a check of a display: one that breaks a promise is found out; another package's stands on the page."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cyclopean.testing import BrokenPromiseError, prove_diagnostic
from devices.diagnostics import DIAGNOSTICS, Diagnosis, DisplayCheck, judge_display
from devices.readings import Measurements, write_csv

CHECK = """
from devices.diagnostics import Check, DisplayCheck

CYCLOPEAN_INTERFACE = 1
CHECK = Check("bright", "White is bright", 80.0, "cd/m²", "our laboratory", at_least=True)

def bright(readings):
    white = readings.XYZ[(readings.codes == 1).all(axis=1), 1]
    if not len(white):
        return CHECK.unjudged("White was not read.")
    return CHECK.judged(white.mean(), f"White has {white.mean():.4g} cd/m².")

BRIGHT = DisplayCheck(bright, after="primaries")
"""
BROKEN = {
    'Check("bright"': ('Check("light"', "no Diagnosis named bright"),
    "CHECK.judged(white.mean(), f": ("CHECK.unjudged(f", "it is open"),
    ".4g} cd/m².": (".4g} cd/m².{__import__('time').time_ns()}", "says the same again"),
    '{white.mean():.4g} cd/m².")': ('it.", table=len)', "JSON serializable"),
    'CHECK.unjudged("White was not read.")': ("white[0]", "IndexError"),
    "not read.": ("not read", "of black alone it says"),
}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    codes = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]])
    primaries = np.array([[41.2, 21.3, 1.9], [35.8, 71.5, 11.9], [18.0, 7.2, 95.0]])
    write_csv(Measurements(codes, 0.1 + codes @ primaries), tmp_path / "a.csv")
    return tmp_path / "a.csv"


@pytest.mark.parametrize("old", ["", *BROKEN])
def test_a_broken_promise_is_found(file: Path, old: str) -> None:
    new, said = BROKEN.get(old, ("", ""))
    held: dict[str, DisplayCheck] = {}
    exec(CHECK.replace(old, new) if old else CHECK, held)
    if not old:
        assert len(prove_diagnostic("bright", file, check=held["BRIGHT"])) == 4
        return
    with pytest.raises(BrokenPromiseError, match=said):
        prove_diagnostic("bright", file, check=held["BRIGHT"])


def _judged(file: Path) -> dict[str, Diagnosis]:
    return {one.name: one for one in judge_display([file]).diagnoses}


def test_another_package_s_stands_where_it_says_and_one_that_raises_leaves_the_rest(
    file: Path, install: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    before = _judged(file)
    monkeypatch.setattr(DIAGNOSTICS, "_loaded", {})
    install("bright", CHECK, "1.2", group=DIAGNOSTICS.group, bright="BRIGHT")
    torn = CHECK.replace("    white =", "    1 / 0\n    white =").replace('"bright"', '"torn"')
    install("torn", torn, "2.1", group=DIAGNOSTICS.group, torn="BRIGHT", gone="NO_SUCH")
    found = _judged(file)
    names = list(found)
    assert names[names.index("primaries") + 1 :][:2] == ["bright", "torn"]
    assert (found["bright"].passed, found["bright"].source) == (True, "our laboratory; bright 1.2")
    assert found["torn"].verdict == "open"
    assert "torn 2.1" in found["torn"].words
    assert "ZeroDivisionError" in found["torn"].words
    assert found["gone"].verdict == "open"
    assert "torn 2.1" in found["gone"].words
    assert {name: one for name, one in found.items() if name not in ("bright", "torn", "gone")} == before
