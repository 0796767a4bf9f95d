"""Tables of paired comparisons: who was preferred over whom, how often, by which observer."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
