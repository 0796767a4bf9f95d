"""The page and the experiment that a comparison of two pictures ends in."""
