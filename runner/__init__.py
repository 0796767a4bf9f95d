"""Showing pictures to observers and recording their answers; the command line."""
