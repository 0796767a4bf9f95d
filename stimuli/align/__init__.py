"""Alignment of two views: pairs brought to zero parallax at the sample's plane, and the disparity that is left.

Section 4.4.2 of the thesis. Places are in pixels, x to the right and y down, of the middle of a pixel; a shift is where
something lies in the right (or moving) picture minus where it lies in the left (or reference) one, so that a positive
horizontal shift is a positive parallax: behind the screen.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
