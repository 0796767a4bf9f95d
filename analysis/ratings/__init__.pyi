from .ratings import rating_tables as rating_tables
from .ratings import summarise_ratings as summarise_ratings
