"""Measures of the pictures that an experiment showed, beside what its observers said of them."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
