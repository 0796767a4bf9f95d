from .find import SparkleThreshold as SparkleThreshold
from .measure import PixelScale as PixelScale
from .measure import SparkleMeasures as SparkleMeasures
from .measure import measure_sparkles as measure_sparkles
from .measure import shared_sparkles as shared_sparkles
