"""Bracketed photographs of one scene, merged to one picture of linear light by the noise of the sensor."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
