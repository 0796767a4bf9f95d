"""Comparing a photograph with its rendering: colour, place, sparkle, depth, and the verdict."""
