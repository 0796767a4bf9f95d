"""Measures of how far two pictures differ, as they are published with: each a kind, registered by its name."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
