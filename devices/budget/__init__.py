"""What each step from a picture's file to the eye costs in ΔE00."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
