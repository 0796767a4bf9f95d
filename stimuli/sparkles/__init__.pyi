from .background import local_background as local_background
from .find import SparkleThreshold as SparkleThreshold
from .find import find_peaks as find_peaks
from .measure import PixelScale as PixelScale
from .measure import SparkleMeasures as SparkleMeasures
from .measure import Uncertain as Uncertain
from .measure import measure_sparkles as measure_sparkles
from .measure import shared_sparkles as shared_sparkles
