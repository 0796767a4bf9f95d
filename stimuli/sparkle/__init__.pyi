from .flakes import scatter_flakes as scatter_flakes
from .scene import wavelengths_nm as wavelengths_nm
from .studio import Studio as Studio
from .studio import plate_light as plate_light
