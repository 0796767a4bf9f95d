"""The sections of the page, a file each: results as tables, figures and text."""
