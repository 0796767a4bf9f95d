from .summary import summarise_series as summarise_series
