"""Whether a display keeps what its model takes for granted: one check a file, each a function of measurements."""
