"""From camera files to linear camera RGB, and to XYZ through a camera's characterisation."""
