"""The parts of a session: coroutines that yield what to ask and what to record, and are independent of screens."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
