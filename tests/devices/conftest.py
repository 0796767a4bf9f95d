"""Displays are fitted once for all tests that fit the same readings: a fit takes a second."""

from __future__ import annotations

import pytest

from devices.characterise import display_fit
from devices.characterise.choose import characterise
from tests.kept import kept

_CHARACTERISE = kept(characterise)


@pytest.fixture
def fits_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a display be fitted once to the same readings in the same way."""
    monkeypatch.setattr(display_fit, "characterise", _CHARACTERISE)
