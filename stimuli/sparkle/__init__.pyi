from .flakes import scatter_flakes as scatter_flakes
from .light import wavelengths_nm as wavelengths_nm
from .measures.find import Threshold as Threshold
from .measures.measure import PixelScale as PixelScale
from .measures.measure import measure_sparkles as measure_sparkles
from .measures.measure import shared_sparkles as shared_sparkles
from .studio import plate_light as plate_light
