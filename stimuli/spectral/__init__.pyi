from .bands import read_spectral as read_spectral
from .convert import convert_spectral as convert_spectral
from .light import Illumination as Illumination
from .metamerism import metamerism_of_files as metamerism_of_files
from .options import MetamerismOptions as MetamerismOptions
from .options import Quantity as Quantity
from .options import SensorOptions as SensorOptions
from .options import SpectralOptions as SpectralOptions
