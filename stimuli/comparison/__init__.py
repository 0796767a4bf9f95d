"""Comparing a photograph with its rendering: colour, place, sparkle, depth, and the verdict."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
