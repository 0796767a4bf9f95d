from .bands import read_spectral as read_spectral
from .convert import VirtualCamera as VirtualCamera
from .convert import convert_spectral as convert_spectral
from .light import Illumination as Illumination
from .metamerism import metamerism_of_files as metamerism_of_files
from .picture import Quantity as Quantity
