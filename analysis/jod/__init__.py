"""JOD as pwcmp scales it: Thurstone's Case V with a prior on distances, and intervals by bootstrap."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
