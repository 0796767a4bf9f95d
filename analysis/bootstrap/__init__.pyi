from .confidence_intervals import intervals as intervals
from .replicates import resample as resample
from .stability import Covariance as Covariance
from .stability import class_stability as class_stability
