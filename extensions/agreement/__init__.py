"""Whether measures of pictures agree with observers: correlations, pairs that observers tell apart, limits."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
