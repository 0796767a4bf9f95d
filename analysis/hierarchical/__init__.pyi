from .fitting import fit_observers as fit_observers
from .fitting import observer_spread as observer_spread
from .result import GroupScores as GroupScores
from .result import HierarchicalFit as HierarchicalFit
from .spread import Spread as Spread
from .terminal import observer_table as observer_table
from .terminal import print_fit as print_fit
from .terminal import summary_lines as summary_lines
