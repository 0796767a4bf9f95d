"""Observers drawn anew: what scores and classes would have been with other observers of the same kind."""
