from .outliers import ObserverLikelihood as ObserverLikelihood
from .scale import JodItem as JodItem
from .scale import JodOptions as JodOptions
from .scale import JodScale as JodScale
from .scale import JodScales as JodScales
from .scale import scale_jod as scale_jod
from .shown import jod_blocks as jod_blocks
from .shown import unsettled_lines as unsettled_lines
