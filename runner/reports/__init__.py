"""Pages and pictures that the program writes for people."""
