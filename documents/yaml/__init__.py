"""YAML files: read, located, checked."""
