"""Ratings of single stimuli, and preferences between stereo and flat."""
