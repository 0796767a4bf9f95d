from .classes import classify as classify
from .multiplicity import Adjust as Adjust
