from .bracket import BracketReport as BracketReport
from .bracket import bracket_photographs as bracket_photographs
from .merge import Merged as Merged
from .merge import merge_exposures as merge_exposures
from .noise import NoiseModel as NoiseModel
from .noise import parse_noise as parse_noise
from .options import BracketOptions as BracketOptions
