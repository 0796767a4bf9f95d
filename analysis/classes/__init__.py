"""Perceptual classes: which items the answers do not separate."""
