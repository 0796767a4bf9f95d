"""What a screen, glasses or a camera does to colour, and the geometry of viewing.

A display is characterised through the glasses, in each stereo mode and for each eye: readings become a display model
that goes from codes to XYZ and back. Crosstalk, an uneven panel and dithering are compensated; a camera turns its RGB
into XYZ.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
