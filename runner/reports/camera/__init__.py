"""The page on a fitted camera: what it predicts, what it was fitted to, and what was left out."""
