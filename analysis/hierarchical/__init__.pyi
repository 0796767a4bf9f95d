from .fitting import fit_observers as fit_observers
from .fitting import observer_spread as observer_spread
from .result import GroupScores as GroupScores
from .result import HierarchicalFit as HierarchicalFit
from .shown import fit_blocks as fit_blocks
from .shown import observer_table as observer_table
from .shown import summary_lines as summary_lines
from .spread import ObserverSd as ObserverSd
