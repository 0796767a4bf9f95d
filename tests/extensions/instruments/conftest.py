"""Instruments at the far end of a pseudo-terminal."""

from tests.devices.readings.conftest import play

__all__ = ["play"]
