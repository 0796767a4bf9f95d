"""Observers who differ: individual and categorical ones, and an object beside its match on a screen as they see it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
