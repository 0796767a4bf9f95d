"""A report on the sessions of one experiment: a summary, a table for the terminal, a page to read and print."""
