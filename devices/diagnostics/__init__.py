"""Whether a display keeps what its model takes for granted: one check a file, each a function of measurements."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
