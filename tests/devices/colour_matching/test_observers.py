"""Colorimetric observers by name: the published tables, and how names are read."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from devices.colour_matching import STANDARD_OBSERVERS, ObserverSpec, colorimetric_observer, mixed_observers
from devices.errors import DeviceError
from documents.yaml import Strict


@pytest.mark.parametrize("name", STANDARD_OBSERVERS)
def test_standard_functions_are_the_published_tables_to_the_last_digit(name: str) -> None:
    from colour.colorimetry.datasets.cmfs import MSDS_CMFS

    published = MSDS_CMFS[f"{name} Degree Standard Observer"]
    observer = colorimetric_observer(name)
    np.testing.assert_array_equal(observer.wavelengths_nm, published.wavelengths)
    np.testing.assert_array_equal(observer.functions, published.values)


@pytest.mark.parametrize(
    ("name", "efficacy"),
    [("CIE 1964 10", 683.6), ("CIE 2015 2", 683.358), ("CIE 2015 10", 683.144), ("CIE 1931 2", 683.002)],
)
def test_efficacy_is_683_at_540_THz(name: str, efficacy: float) -> None:
    observer = colorimetric_observer(name)
    assert 683 / observer.functions_at([555.017])[0, 1] == pytest.approx(efficacy, abs=1e-2)
    assert observer.efficacy_lm_W == pytest.approx(efficacy, rel=4e-6)


@pytest.mark.parametrize(
    ("written", "name"),
    [
        ("1964_10", "CIE 1964 10"),
        ("1931_2", "CIE 1931 2"),
        ("2012_2", "CIE 2015 2"),
        ("cie 2015 10°", "CIE 2015 10"),
        ("CIE 1964 10 deg", "CIE 1964 10"),
        ("CIE 2006 4 age 45", "CIE 2006 4 age 45"),
        ("CIE 2006 4.0° age 45", "CIE 2006 4 age 45"),
    ],
)
def test_names_may_be_written_in_several_ways(written: str, name: str) -> None:
    assert colorimetric_observer(written).name == name


@pytest.mark.parametrize("wrong", ["CIE 1976", "1931_10", "", "CIE 2006 4", "CIE 2006 4 age 15", "CIE 2006 11 age 32"])
def test_another_name_is_refused_with_what_to_write(wrong: str) -> None:
    with pytest.raises(DeviceError) as caught:
        colorimetric_observer(wrong)
    assert len(caught.value.findings) == 1
    assert caught.value.findings[0].remedy


def test_equal_names_are_equal_observers() -> None:
    assert colorimetric_observer("1964_10") == colorimetric_observer("CIE 1964 10")
    assert len({colorimetric_observer(name) for name in (*STANDARD_OBSERVERS, "1931_2")}) == len(STANDARD_OBSERVERS)
    with pytest.raises(ValueError, match="read-only"):
        colorimetric_observer("CIE 1931 2").functions[0, 0] = 1.0


class _File(Strict):
    observer: ObserverSpec = "CIE 1931 2"


def test_a_file_names_an_observer_or_gives_age_and_field() -> None:
    assert _File.model_validate({"observer": "1964_10"}).observer == "CIE 1964 10"
    by_age = {"kind": "cie2006", "age_years": 32, "field_deg": 10}
    assert _File.model_validate({"observer": by_age}).observer == "CIE 2006 10 age 32"
    for wrong in ("CIE 1976", {**by_age, "age_years": 12}, {**by_age, "kind": "cie2015"}, 3):
        with pytest.raises(ValidationError):
            _File.model_validate({"observer": wrong})


def test_mixed_observers_are_found_and_equal_ones_are_not() -> None:
    assert mixed_observers([("a", "CIE 1931 2"), ("b", "CIE 1931 2")]) is None
    assert mixed_observers([]) is None
    found = mixed_observers([("a", "CIE 1931 2"), ("b", "CIE 1931 2"), ("c", "CIE 1964 10")])
    assert found is not None
    assert "c of CIE 1964 10" in found.message
