"""A colour chart's geometry, and which way round its colours lie."""
