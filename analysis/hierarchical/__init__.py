"""Observers as a distribution: scores of the typical observer, how much observers differ, what a new one would say."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
