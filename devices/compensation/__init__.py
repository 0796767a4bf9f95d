"""Crosstalk, gain maps, dithering, and what clipping costs."""
