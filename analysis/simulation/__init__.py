"""Studies simulated under assumed scores and analysed as a report does, and the smallest difference a design finds."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
