"""Putting a scene on a screen, one picture for each eye, with the display's response undone."""
