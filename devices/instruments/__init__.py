"""Instruments that read the light of a patch, and what can go wrong with them."""

from devices.instruments.instrument import Instrument, Reading, Showing
from devices.instruments.open import INSTRUMENTS, open_instrument

__all__ = ["INSTRUMENTS", "Instrument", "Reading", "Showing", "open_instrument"]
