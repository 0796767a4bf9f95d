"""The parts of the page, a file each: from what was found to tables, figures and words."""
