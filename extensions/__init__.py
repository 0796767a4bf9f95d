"""What stands on the core's faces as another package's extension would, found through entry points."""
