from .classes import TIED as TIED
from .classes import classify as classify
from .conclusions import Conclusion as Conclusion
from .multiplicity import ADJUSTMENT_NAMES as ADJUSTMENT_NAMES
from .multiplicity import corrected as corrected
from .multiplicity import holm as holm
from .multiplicity import two_sided_p as two_sided_p
