from .agreement import ranks as ranks
from .choices import KIND as KIND
from .choices import gather as gather
from .observer_means import Estimated as Estimated
from .observer_means import means as means
from .summary import SeriesSummary as SeriesSummary
from .summary import summarise_series as summarise_series
