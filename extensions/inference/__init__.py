"""What more can be inferred from paired comparisons: JOD as pwcmp has them, observers as a distribution."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
