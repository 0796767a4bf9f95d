from .exr_read import read_exr as read_exr
from .exr_views import Part as Part
from .exr_views import Region as Region
from .exr_write import write_exr as write_exr
from .resampling import resample_picture as resample_picture
from .resolution import display_resolution as display_resolution
from .stereo_image import StereoImage as StereoImage
from .stereo_image import XYZImage as XYZImage
