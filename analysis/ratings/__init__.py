"""Ratings of single stimuli, and preferences between stereo and flat."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
