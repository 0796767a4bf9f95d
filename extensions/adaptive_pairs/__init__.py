"""Pairs of many stimuli, chosen by the answers so far: those of one observer, or of all together."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
