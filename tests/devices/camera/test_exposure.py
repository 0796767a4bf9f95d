"""Exposures: Expression 4.9, and how two compare."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.camera import Exposure, parse_exposure
from devices.camera.exposure import parse_seconds
from devices.errors import DeviceError

_ABOVE = st.floats(1e-4, 1e4)
EXPOSURES = st.builds(Exposure, _ABOVE, st.floats(0.5, 64), st.floats(1, 1e6))


def test_exposure_value_is_expression_4_9() -> None:
    assert Exposure(1.0, 1.0, 3200).ev == 0
    assert Exposure(1 / 16, 8.0, 800).ev == pytest.approx(10.0, abs=1e-12)


def test_a_stop_more_by_time_by_aperture_or_by_iso() -> None:
    plain = Exposure(1 / 15, 8.0, 800)
    assert Exposure(2 / 15, 8.0, 800).relative_to(plain) == pytest.approx(2)
    assert Exposure(1 / 15, 8.0 / 2**0.5, 800).relative_to(plain) == pytest.approx(2)
    assert Exposure(1 / 15, 8.0, 1600).relative_to(plain) == pytest.approx(2)


@given(EXPOSURES, EXPOSURES)
def test_one_beside_the_other_and_back(one: Exposure, other: Exposure) -> None:
    assert one.relative_to(other) * other.relative_to(one) == pytest.approx(1, rel=1e-12)
    # At one ISO, an exposure value less is twice the signal.
    alike = Exposure(one.time_s, one.f_number, other.iso)
    assert alike.relative_to(other) == pytest.approx(2 ** (other.ev - alike.ev), rel=1e-9)


def test_what_metadata_round_is_the_same_and_a_third_of_a_stop_is_not() -> None:
    third = Exposure(1 / 3, 8.0, 800)
    assert Exposure(0.3333, 8.0, 800).same_signal(third)
    assert not Exposure(1 / 3 * 2 ** (1 / 3), 8.0, 800).same_signal(third)


def test_written_as_on_a_camera() -> None:
    assert parse_exposure("1/15,8,800") == Exposure(1 / 15, 8.0, 800.0)
    assert parse_exposure(" 1.3 , f/2.8 ") == Exposure(1.3, 2.8, 100.0)
    assert parse_seconds("1/2.5") == pytest.approx(0.4)
    assert str(Exposure(1 / 15, 8.0, 800)) == "1/15 s, f/8, ISO 800"
    assert str(Exposure(0.4, 8.0, 800)) == "0.4 s, f/8, ISO 800"


@pytest.mark.parametrize("text", ["", "1/15", "a,8,800", "1/0,8,800", "1,8,800,3", "0,8,800", "1,-8,800", "nan,8,800"])
def test_what_is_no_exposure_is_refused_with_one_finding(text: str) -> None:
    with pytest.raises(DeviceError) as caught:
        parse_exposure(text)
    assert len(caught.value.findings) == 1
    assert caught.value.findings[0].remedy
