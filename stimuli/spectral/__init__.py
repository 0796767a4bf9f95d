"""Pictures of many wavelengths, from a renderer or a spectral camera: to XYZ, and to a camera's RGB."""

from stimuli.spectral.picture import SpectralPicture
from stimuli.spectral.read import read_spectral
from stimuli.spectral.to_camera import spectral_to_camera
from stimuli.spectral.to_xyz import spectral_to_xyz

__all__ = ["SpectralPicture", "read_spectral", "spectral_to_camera", "spectral_to_xyz"]
