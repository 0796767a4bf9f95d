"""Who answers: a person at the keys, or a simulation with known scores."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
