"""Pictures for two eyes in absolute XYZ: reading, writing and resampling them."""
