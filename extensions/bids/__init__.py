"""Export of results as a BIDS dataset: a table of answers per session, sidecars for its columns, and the raw logs."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
