"""What is drawn to: an offscreen surface, a window, a window without a screen."""
