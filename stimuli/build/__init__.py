"""Building a recipe into a set of pictures on disk, each picture once."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
