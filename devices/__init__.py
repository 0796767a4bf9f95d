"""What a screen, glasses or a camera does to colour, and the geometry of viewing."""
