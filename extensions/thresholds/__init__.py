"""Thresholds: psychometric functions, the adaptive methods that choose levels by the answers, and fits."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
