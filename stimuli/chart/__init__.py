"""A colour chart in a photograph: where it lies, which way up, and the camera's values of its patches."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
