from .confidence_intervals import intervals as intervals
from .replicates import resample as resample
from .replicates import resample_groups as resample_groups
from .stability import class_stability as class_stability
