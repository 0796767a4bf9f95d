"""Files on disk: paths, limits, whole writes."""
