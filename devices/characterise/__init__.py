"""From measured patches to a display model: fits of the thesis, models beyond, and a choice on held-out readings."""
