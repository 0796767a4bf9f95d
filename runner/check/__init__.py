"""What a file means before a session: read it with everything it names, and report what a session would be."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
