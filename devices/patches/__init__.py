"""Patches to show a display and measure: which codes, in which order, and how the instrument stands for each."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
