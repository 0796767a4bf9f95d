"""Readings of a display: what to measure, the instruments that measure it, and the tables and logs of what was read."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
