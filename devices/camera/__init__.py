"""A camera as a colour device: exposures, linear camera RGB to XYZ, its file, and the fit to a chart."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
