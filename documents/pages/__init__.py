"""Results as sections, and one writer of them for pages, for the terminal and for CSV."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
