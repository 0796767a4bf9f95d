"""The report on an experiment: all results, the page, the table for the terminal, and JSON."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
