from .multiplicity import Adjust as Adjust
