"""The report on an experiment: all results, the page, the table for the terminal, and JSON."""
