"""Putting a scene on a screen, one picture for each eye, with the display's response undone."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
