"""PLVC in a display file: written and read back, and every wrong number refused in a clear line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from devices.display import Plvc, TableCurve, read_display
from devices.display.model_spec import ModelSpec
from documents import InputError

PANEL = "schema_version: 1\npanel: {resolution_px: [1920, 1080], pixel_pitch_mm: 0.25}\nmodes:\n"
PRIMARIES = np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]])


def plvc() -> Plvc:
    x = np.linspace(0.0, 1.0, 9)
    curve = TableCurve(tuple(x), tuple(x**2.2))
    own = PRIMARIES.T[:, np.newaxis] * np.linspace(0.97, 1.02, 36).reshape(3, 4, 3)
    return Plvc(np.full(3, 0.1), PRIMARIES, (curve, curve, curve), own, np.linspace(-2, 2, 30).reshape(10, 3))


def written(folder: Path, lines: list[str]) -> Path:
    file = folder / "display.yaml"
    file.write_text(PANEL + "  flat:\n" + "".join(f"    {line}\n" for line in lines), encoding="utf-8")
    return file


def test_it_is_read_as_it_was_written(tmp_path: Path) -> None:
    model = plvc()
    display = read_display(written(tmp_path, ModelSpec.of(model, source="by hand").lines()))
    read = display.models("flat").left
    assert isinstance(read, Plvc)
    codes = np.random.default_rng(1).uniform(0, 1, (200, 3))
    np.testing.assert_allclose(read.xyz(codes), model.xyz(codes), rtol=1e-8)
    assert display.sources["flat"] == "by hand"


def test_mixtures_may_be_left_out(tmp_path: Path) -> None:
    document = yaml.safe_load("\n".join(ModelSpec.of(plvc(), source="").lines()))
    del document["curve"]["mixtures_XYZ_cd_m2"]
    read = read_display(written(tmp_path, yaml.safe_dump(document).splitlines())).models("flat").left
    assert isinstance(read, Plvc)
    assert not read.mixtures_XYZ_cd_m2.any()


WRONG: dict[str, tuple[Callable[[dict[str, Any]], object], str]] = {
    "three rows": (lambda c: c["red"]["XYZ_per_light_cd_m2"].pop(), "XYZ_per_light_cd_m2"),
    "two numbers": (lambda c: c["red"]["XYZ_per_light_cd_m2"][0].pop(), "XYZ_per_light_cd_m2"),
    "text": (lambda c: c["green"]["XYZ_per_light_cd_m2"].__setitem__(1, "much"), "XYZ_per_light_cd_m2"),
    "infinite": (lambda c: c["green"]["XYZ_per_light_cd_m2"][1].__setitem__(0, float("inf")), "finite"),
    "not a number": (lambda c: c["mixtures_XYZ_cd_m2"]["red_green"].__setitem__(0, float("nan")), "finite"),
    "a strange key": (lambda c: c["mixtures_XYZ_cd_m2"].update(red_rad=[0, 0, 0]), "red_rad"),
    "a channel that falls": (
        lambda c: c["green"].update(XYZ_per_light_cd_m2=[[-35, -70, -11]] * 4),
        "more drive gives less light",
    ),
    "mixtures beyond all light": (
        lambda c: c["mixtures_XYZ_cd_m2"].update(red_green_blue=[-900, -900, -900]),
        "more drive gives less light",
    ),
    "enormous": (lambda c: c["mixtures_XYZ_cd_m2"].update(red_green=[1e300, 1e300, 1e300]), "at most 1e.12"),
    "very much": (lambda c: c["mixtures_XYZ_cd_m2"].update(red_green=[1e12, 1e12, 1e12]), "cannot be undone"),
    "no tables": (lambda c: c["blue"].pop("light"), "light"),
    "light that falls": (lambda c: c["blue"]["light"].__setitem__(3, 0.9), "rise from 0 to 1"),
}


@pytest.mark.parametrize("fault", WRONG)
def test_what_is_wrong_is_named_with_its_file_and_place(tmp_path: Path, fault: str) -> None:
    spoil, says = WRONG[fault]
    document = yaml.safe_load("\n".join(ModelSpec.of(plvc(), source="").lines()))
    spoil(document["curve"])
    with pytest.raises(InputError, match=says) as refused:
        read_display(written(tmp_path, yaml.safe_dump(document).splitlines()))
    for finding in refused.value.findings:
        assert str(finding.file).endswith("display.yaml")
        assert finding.line
