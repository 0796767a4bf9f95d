"""How a trial looks: layouts, pictures beside or after each other, pages of words, and the words of the interface."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
