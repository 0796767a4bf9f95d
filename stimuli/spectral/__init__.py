"""Pictures of many wavelengths, from a renderer or a spectral camera: to XYZ, and to a camera's RGB."""
