"""Marks to other machines at onsets and answers: on Lab Streaming Layer, a serial port or a parallel port."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
