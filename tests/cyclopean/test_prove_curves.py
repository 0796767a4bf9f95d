"""What proves curves of a display: ours keep the promises, a broken one is found; another package's are used."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cyclopean.testing import BrokenPromiseError, prove_curves
from devices.characterise import fit_display, table_c1_codes
from devices.display import CURVES, DisplayCurves, read_display
from devices.readings import Measurements
from documents import InputError

CURVE = """
from typing import ClassVar, Literal
import numpy as np
from scipy.optimize import minimize_scalar
from devices.display import Curve, DisplayCurves
from documents.yaml import Positive

CYCLOPEAN_INTERFACE = 1

class Sigmoid(Curve):
    kind_of_curve: ClassVar[str] = "sigmoid"
    half: Positive
    lift: ClassVar[float] = 0.0

    def linear(self, code):
        power = np.asarray(code, float) ** 2
        return power * (1 + self.half) / (power + self.half)

    def unclipped_code(self, light_above_lift):
        light = np.minimum(light_above_lift, 1)
        return np.sqrt(self.half * light / (1 + self.half - light))

class SigmoidCurves(DisplayCurves):
    kind: Literal["sigmoid"]
    half: Positive

    @property
    def channels(self):
        return (Sigmoid(half=self.half),) * 3

    @classmethod
    def fitted(cls, codes, XYZ_cd_m2, begin):
        def light(half):
            return np.column_stack([np.ones(len(codes)), Sigmoid(half=half).linear(codes)])

        def off(half):
            return np.ptp(light(half) @ np.linalg.lstsq(light(half), XYZ_cd_m2, rcond=None)[0] - XYZ_cd_m2)

        half = float(minimize_scalar(off, bounds=(0.01, 10), method="bounded").x)
        black, *primaries = np.linalg.lstsq(light(half), XYZ_cd_m2, rcond=None)[0]
        return cls(kind="sigmoid", half=half).model(black, np.array(primaries).T), 13

    @classmethod
    def written(cls, model):
        return {"kind": "sigmoid", "half": model.curves[0].half}
"""
LINEAR, INVERSE = (
    "power * (1 + self.half) / (power + self.half)",
    "np.sqrt(self.half * light / (1 + self.half - light))",
)
BROKEN = {
    "does not rise": {"float) ** 2": "float) ** 2 * (2 - np.asarray(code, float)) ** 4"},
    "come back": {"np.sqrt(": "0.99 * np.sqrt("},
    "nearest code": {
        "class SigmoidC": "    def code(self, linear): return self.unclipped_code(abs(linear))\nclass SigmoidC"
    },
    "its table is off": {  # nearly flat in its middle
        LINEAR: "0.5 + 256 * (np.sqrt(power) - 0.5) ** 9",
        INVERSE: "0.5 + np.sign(light - 0.5) * (abs(light - 0.5) / 256) ** (1 / 9)",
    },
    "curves run from": {LINEAR: "0.9 * power", INVERSE: "np.sqrt(light / 0.9)"},
    "does not predict": {"bounds=(0.01, 10)": "bounds=(5, 10)"},
    "off by": {"bounds=(0.01, 10)": "bounds=(0.01, 0.48)"},
}


def _kind(changed: dict[str, str]) -> type[DisplayCurves]:
    held: dict[str, Any] = {}
    text = CURVE
    for old, new in changed.items():
        assert old in text
        text = text.replace(old, new)
    exec(compile(text, "curve", "exec", dont_inherit=True), held)
    kind: type[DisplayCurves] = held["SigmoidCurves"]
    return kind


@pytest.mark.parametrize(
    "entry",
    [
        "kind: srgb",
        "kind: bt1886",
        "kind: gog, red: &r {gain: 0.97, offset: 0.03, gamma: 2.1}, green: *r, blue: *r",
        "kind: table, red: &r {codes: [0, 0.4, 1], light: [0, 0.2, 1]}, green: *r, blue: *r",
    ],
)
def test_ours_keep_the_promises(entry: str) -> None:
    assert len(prove_curves(entry)) == 6


@pytest.mark.parametrize("said", BROKEN)
def test_a_broken_promise_is_found(said: str) -> None:
    with pytest.raises(BrokenPromiseError, match=said):
        prove_curves("kind: sigmoid, half: 0.5", kind=_kind(BROKEN[said]))


def test_a_session_knows_other_curves_with_the_same_numbers() -> None:
    fields = {"kind": "sigmoid", "half": 0.5}
    sound, other = (_kind(BROKEN[said] if said else {}).model_validate(fields) for said in ("", "curves run from"))
    made = [one.model(np.zeros(3), np.eye(3)).numbers for one in (sound, sound, other)]
    assert made[0] == made[1] != made[2]


def test_another_packages_curves_are_read_and_named(
    install: Callable[..., None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(CURVES, "_loaded", {})
    install("sigmoids", CURVE, "2.1", group=CURVES.group, sigmoid="SigmoidCurves")
    install(
        "torn",
        CURVE.replace("sigmoid", "torn").replace("return (", "return 1 / 0, ("),
        group=CURVES.group,
        torn="SigmoidCurves",
    )
    assert len(prove_curves("kind: sigmoid, half: 0.5")) == 7
    file = tmp_path / "display.yaml"
    text = Path("configs/displays/asus_vg248qe.yaml").read_text()
    begin = text.index("    curve:")
    end = text.index("    source:", begin)
    text = text[:begin] + "    curve: {kind: sigmoid, half: 0.5}\n" + text[end:]
    file.write_text(text)
    display = read_display(file)
    assert display.sources["side-by-side"].endswith("; sigmoid of sigmoids 2.1")
    assert float(display.models("side-by-side").left.curves[0].linear(0.5)) == 0.5
    model = display.models("side-by-side").left
    codes = table_c1_codes()
    readings = Measurements(codes, model.xyz(codes), mode="side-by-side")
    fit = fit_display(readings, model="sigmoid").write(file, replace=True)
    chosen = fit.eyes["both"].characterisation.chosen
    assert (chosen.name, chosen.free_numbers, chosen.held_out.max < 0.01) == ("sigmoid", 13, True)
    assert np.allclose(read_display(file).models("side-by-side").left.xyz(codes), model.xyz(codes), atol=1e-4)
    for wrong, said in (
        ("sigmund", "'sigmoid'"),
        ("residul", "'residual'"),
        ("srgb", "one of: auto.*residual, none, sigmoid"),
    ):
        with pytest.raises(InputError, match=said):
            fit_display(readings, model=wrong)
    for kind, said in (("sigmund", "'sigmoid'"), ("torn", "torn 1.0.*ZeroDivisionError")):
        file.write_text(text.replace("sigmoid", kind))
        with pytest.raises(InputError, match=said) as error:
            read_display(file)
        assert error.value.findings[0].line
