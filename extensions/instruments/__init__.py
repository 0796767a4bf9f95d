"""Instruments that read light: Konica Minolta CS-2000, Photo Research PR-655, and those that ArgyllCMS reads."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
