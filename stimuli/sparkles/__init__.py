"""Which sparkles a picture holds: where, how many, how large, how bright, and for which eyes."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
