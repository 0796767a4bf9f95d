"""Displays are fitted once for all tests that fit the same readings: a fit takes a second."""

from __future__ import annotations

import pickle

import pytest

from devices.characterise import display_fit
from devices.characterise.choose import Characterisation, characterise

_KEPT: dict[bytes, Characterisation] = {}


@pytest.fixture
def fits_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a display be fitted once to the same readings in the same way."""
    fit = characterise

    def kept(*words: object, **how: object) -> Characterisation:
        key = pickle.dumps((words, how))
        if key not in _KEPT:
            _KEPT[key] = fit(*words, **how)  # type: ignore[arg-type]  # they are passed on
        return _KEPT[key]

    monkeypatch.setattr(display_fit, "characterise", kept)
