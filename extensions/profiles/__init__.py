"""A display's model written for other programs: ICC profiles and .cube tables; colours converted by it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
