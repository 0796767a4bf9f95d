from .exposures import ContrastOverExposure as ContrastOverExposure
from .exposures import contrast_over_exposure as contrast_over_exposure
from .flakes import scatter_flakes as scatter_flakes
from .plate_recipe import SparklePlateRecipe as SparklePlateRecipe
from .scene import wavelengths_nm as wavelengths_nm
from .series_recipe import SparkleSeriesRecipe as SparkleSeriesRecipe
from .studio import Studio as Studio
from .studio import plate_light as plate_light
