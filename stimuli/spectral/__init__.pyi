from .bands import read_spectral as read_spectral
from .convert import convert_spectral as convert_spectral
from .curves import read_illuminant as read_illuminant
from .curves import read_reflectances as read_reflectances
from .light import Illumination as Illumination
from .options import Quantity as Quantity
from .options import SensorOptions as SensorOptions
from .options import SpectralOptions as SpectralOptions
