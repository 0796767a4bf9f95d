"""Pictures of vision tests: random-dot stereograms, Landolt rings, pseudoisochromatic plates."""
