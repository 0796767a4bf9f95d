"""Display files: what modes carry, one eye alone, and absurd numbers."""

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
from devices.errors import DeviceError
from documents import InputError
from runner.check import CheckOptions, CheckReport
from runner.check.files import check_display
from tests.kept import known

# Crosstalk and gain map of a display file's modes.

ROOT = Path(__file__).parents[2]
HEAD = "schema_version: 1\npanel: {resolution_px: [640, 480], pixel_pitch_mm: 0.3}\nmodes:\n  flat:\n"
MODEL = """\
    black_XYZ_cd_m2: [0, 0, 0]
    primaries_XYZ_cd_m2: {red: [4, 2, 0], green: [3, 7, 1], blue: [2, 1, 9]}
    curve: {kind: gamma, red: {gamma: 2}, green: {gamma: 2}, blue: {gamma: 2}}
"""
CROSSTALK = """\
    crosstalk:
      left: [[0.03, 0, 0], [0, 0.03, 0], [0, 0, 0.05]]
      right: [[0.02, 0.01, 0], [0, 0.04, 0], [0, 0, 0.06]]
      source: measured through the glasses
"""
GAIN_MAP = "    gain_map: {luminance: [[1, 2], [3, 4]], positions: cells, normalise: centre}\n"


def _file(tmp_path: Path, *parts: str) -> Path:
    path = tmp_path / "d.yaml"
    path.write_text(HEAD + "".join(parts))
    return path


def _indented(model: str) -> str:
    return "".join(f"  {line}\n" for line in model.splitlines())


PER_EYE = f"    left:\n{_indented(MODEL)}    right:\n{_indented(MODEL)}"


@pytest.mark.parametrize("model", [MODEL, PER_EYE], ids=["both eyes", "per eye"])
def test_a_mode_holds_crosstalk_and_a_gain_map(tmp_path: Path, model: str) -> None:
    display = read_display(_file(tmp_path, model, CROSSTALK, GAIN_MAP))
    crosstalk, gain_map = display.crosstalk("flat"), display.gain_map("flat")
    assert np.array_equal(known(crosstalk).left, np.diag([0.03, 0.03, 0.05]))
    assert known(crosstalk).right[0, 1] == 0.01
    assert gain_map is not None
    assert gain_map.resolution_px == (640, 480)
    assert (gain_map.positions, gain_map.normalise) == ("cells", "centre")
    assert gain_map.gain(320, 240) == pytest.approx(1.0)
    assert gain_map.gain(0, 0) == pytest.approx(1 / 2.5)


def test_a_leak_that_takes_light_is_held(tmp_path: Path) -> None:
    display = read_display(_file(tmp_path, MODEL, CROSSTALK.replace("0.03", "-0.03")))
    crosstalk = known(display.crosstalk("flat"))
    assert crosstalk.left[0, 0] == -0.03


def test_same_as_carries_both_along(tmp_path: Path) -> None:
    display = read_display(_file(tmp_path, MODEL, CROSSTALK, GAIN_MAP, "  side-by-side: {same_as: flat}\n"))
    crosstalk, gain_map = display.crosstalk("side-by-side"), display.gain_map("side-by-side")
    assert known(crosstalk).right[0, 1] == 0.01
    assert np.array_equal(known(gain_map).luminance, [[1, 2], [3, 4]])


def test_a_mode_without_them_has_none() -> None:
    display = read_display(ROOT / "configs/displays/asus_vg248qe.yaml")
    assert display.crosstalk("side-by-side") is None
    assert display.gain_map("side-by-side") is None
    for asked in (display.crosstalk, display.gain_map):
        with pytest.raises(DeviceError, match=r"not characterised .* 'anaglyph'"):
            asked("anaglyph")


SAME = "    crosstalk: {left: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], right: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}\n"


@pytest.mark.parametrize(
    ("more", "place", "message"),
    [
        (CROSSTALK.replace("[[0.03", "[[0.03, 1"), ":9:14: ", "crosstalk.left.1"),
        (CROSSTALK.replace("[[0.03", "[[.nan"), ":9:15: ", "finite number"),
        (CROSSTALK.replace("      right", "      wrong"), ":10:7: ", "unknown key 'modes.flat.crosstalk.wrong'"),
        (CROSSTALK.replace("0, 0.03, 0]", "0, -1.4, 0]"), ":8:5: ", "loses"),
        (CROSSTALK.replace("0, 0.04, 0]", "0, 1.4, 0]"), ":8:5: ", "more than all of it"),
        (SAME, ":8:5", "cannot be undone"),
        (GAIN_MAP.replace("[3, 4]", "[3]"), ":8:5: ", "hold 2, 1 readings"),
        (GAIN_MAP.replace("[3, 4]", "[3, 0]"), ":8:40: ", "a number above 0"),
        (GAIN_MAP.replace("cells", "cell"), ":8:56: ", "did you mean 'cells'?"),
        (GAIN_MAP.replace(", normalise: centre", ""), ":8:15: ", "normalise' is missing"),
        ("    gain_map: {luminance: [[1, 2]], positions: corners, normalise: centre}\n", ":8:5", "at least 2 × 2"),
        ("    gain_map: {luminance: [], positions: cells, normalise: centre}\n", ":8:27: ", "at least 1"),
    ],
)
def test_faults_are_placed(tmp_path: Path, more: str, place: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        read_display(_file(tmp_path, MODEL, more))
    assert message in str(caught.value)
    assert f"d.yaml{place}" in str(caught.value)


def test_an_eye_has_no_gain_map_of_its_own(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"d.yaml:8:7: unknown key"):
        read_display(_file(tmp_path, PER_EYE.replace("curve:", "gain_map: 1\n      curve:", 1)))


def test_a_fault_is_told_once_though_two_modes_share_it(tmp_path: Path) -> None:
    bad = CROSSTALK.replace("0, 0.04, 0]", "0, 1.4, 0]")
    with pytest.raises(InputError) as caught:
        read_display(_file(tmp_path, MODEL, bad, "  side-by-side: {same_as: flat}\n"))
    assert len(caught.value.findings) == 1


# Modes that were characterised through one lens so far: kept, told, and not to be used.

ONE_EYE_HEAD = "schema_version: 1\npanel: {resolution_px: [640, 480], pixel_pitch_mm: 0.3}\nmodes:\n"
ONE_EYE_MODEL = """\
{
      black_XYZ_cd_m2: [0, 0, 0], primaries_XYZ_cd_m2: {red: [4, 2, 0], green: [3, 7, 1], blue: [2, 1, 9]},
      curve: {kind: gamma, red: {gamma: 2}, green: {gamma: 2}, blue: {gamma: 2}}}
"""


def _one_eye_file(tmp_path: Path, *lines: str) -> Path:
    path = tmp_path / "display.yaml"
    path.write_text(ONE_EYE_HEAD + "\n".join(lines) + "\n")
    return path


def test_a_mode_of_one_eye_is_lacking_and_refused_with_what_to_do(tmp_path: Path) -> None:
    path = _one_eye_file(
        tmp_path, "  quad-buffered:", f"    right: {ONE_EYE_MODEL}", "  side-by-side: {same_as: quad-buffered}"
    )
    display = read_display(path)
    assert display.modes == {}
    assert display.lacking == {"quad-buffered": ("left",), "side-by-side": ("left",)}
    with pytest.raises(DeviceError, match=r"of the left eye yet.*--eye left"):
        display.models("quad-buffered")
    with pytest.raises(DeviceError, match="left eye"):
        display.crosstalk("quad-buffered")


def test_check_warns_of_it_and_of_none_other(tmp_path: Path) -> None:
    checked = CheckReport(
        _one_eye_file(tmp_path, "  flat:", f"    left: {ONE_EYE_MODEL}", f"    right: {ONE_EYE_MODEL}")
    )
    check_display(checked, CheckOptions())
    assert not checked.warnings
    checked = CheckReport(_one_eye_file(tmp_path, "  flat:", f"    left: {ONE_EYE_MODEL}"))
    check_display(checked, CheckOptions())
    (warning,) = checked.warnings
    assert "'flat' has no characterisation of the right eye" in warning.message


def test_the_eye_that_is_there_is_tried_all_the_same(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match="primaries are so nearly alike"):
        read_display(_one_eye_file(tmp_path, "  flat:", f"    left: {ONE_EYE_MODEL.replace('[3, 7, 1]', '[4, 2, 0]')}"))


# Display files of absurd numbers: refused in a line, or a model of finite numbers, and soon.

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
