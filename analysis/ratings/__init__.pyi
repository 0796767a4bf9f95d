from .ratings import summarise_ratings as summarise_ratings
