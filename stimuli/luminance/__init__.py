"""How bright a picture is, and how bright it is made: factors, grey, tone mapping and statistics."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
