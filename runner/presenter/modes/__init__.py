"""Stereo modes: how one surface shows a picture to each eye."""
