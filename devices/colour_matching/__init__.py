"""Colorimetric observers: colour-matching functions of the CIE, by age and field size, and of individuals."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
