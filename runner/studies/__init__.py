"""New studies: from a folder of pictures, or from an experiment that comes with cyclopean."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
