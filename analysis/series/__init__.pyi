from .choices import gather as gather
from .summary import SeriesSummary as SeriesSummary
from .summary import summarise_series as summarise_series
