"""Tests of an observer's vision on the rig itself: stereo acuity, colour vision, near acuity."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
