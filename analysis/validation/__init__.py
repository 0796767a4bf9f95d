"""Is the rendering the photograph? Differences per pixel and per region, what the eye resolves of them, a verdict.

Arrays and numbers only: reading pictures and bringing them to one grid is not done here.
"""
