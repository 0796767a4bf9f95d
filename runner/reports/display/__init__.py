"""The page that judges a display: a verdict, a figure and a table for each check."""
