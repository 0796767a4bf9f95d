"""Is the rendering the photograph? From two files to numbers, a verdict, a page, and an experiment that asks people."""
