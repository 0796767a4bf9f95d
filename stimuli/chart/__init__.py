"""A colour chart in a photograph: where it lies, which way up, and the camera's values of its patches."""
