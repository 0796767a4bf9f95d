"""From camera files to linear camera RGB, and to XYZ through a camera's characterisation."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
