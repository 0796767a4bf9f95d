"""Measures of what the eye sees in two pictures: ꟻLIP, PU21's SSIM and PSNR, S-CIELAB of 1996, ColorVideoVDP."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
