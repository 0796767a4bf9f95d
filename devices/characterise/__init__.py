"""From measured patches to a display model: fits of the thesis, models beyond, and a choice on held-out readings."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
