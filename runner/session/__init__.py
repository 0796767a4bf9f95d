"""Running a session: the engine, the record it writes, and the station where observers sit down."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
