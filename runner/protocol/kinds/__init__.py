"""What can stand under `blocks:` in an experiment file, one kind a file."""
