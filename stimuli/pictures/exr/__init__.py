"""OpenEXR pictures for two eyes: reading them into absolute XYZ, and writing them."""

from stimuli.pictures.exr.read import read_exr
from stimuli.pictures.exr.region import Part, Region
from stimuli.pictures.exr.views import View, read_views
from stimuli.pictures.exr.write import write_exr

__all__ = ["Part", "Region", "View", "read_exr", "read_views", "write_exr"]
