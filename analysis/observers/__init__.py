"""The observers: how consistent each is, how well they agree, whose answers differ, and who may be left out.

No observer is left out by default: `filters` leaves observers out by a stated rule and reports who and why.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
