"""What `doctor` says of measures of ours."""

from __future__ import annotations

import json

import pytest

from tests.invoked import invoked


def test_doctor_says_which_measures_there_are() -> None:
    assert json.loads(invoked("doctor", "--json").stdout)["measures"]["pu-ssim"] is None


def test_doctor_names_what_a_measure_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stimuli.measures.measure.find_spec", lambda name: None)
    assert json.loads(invoked("doctor", "--json").stdout)["measures"]["flip"] == "pip install '.[measures]'"
    assert "  flip: pip install '.[measures]'" in invoked("doctor").output
