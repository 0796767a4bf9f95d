"""A camera as a colour device: exposures, linear camera RGB to XYZ, its file, and the fit to a chart."""
