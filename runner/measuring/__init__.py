"""Showing patches of known device codes, reading each, and keeping every reading."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
