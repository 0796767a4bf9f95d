"""Building a recipe into a set of pictures on disk, each picture once."""
