"""Showing patches of known device codes, reading each, and keeping every reading."""
