"""What is drawn to: an offscreen surface, a window, a window without a screen."""

from runner.presenter.surfaces.open import open_surface
from runner.presenter.surfaces.surface import Surface, SurfaceFacts

__all__ = ["Surface", "SurfaceFacts", "open_surface"]
