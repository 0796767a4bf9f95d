"""Pictures of many wavelengths, from a renderer or a spectral camera: to XYZ, and to a camera's RGB."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
