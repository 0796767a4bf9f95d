"""Experiment files: what a session consists of, as people write it in YAML."""
