from .bracket import BracketOptions as BracketOptions
from .bracket import BracketReport as BracketReport
from .bracket import bracket_photographs as bracket_photographs
from .merge import Merged as Merged
from .merge import merge_exposures as merge_exposures
from .noise import NoiseModel as NoiseModel
