"""Covariances of strengths: from the Laplacian of compared pairs, and clustered by observer."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
