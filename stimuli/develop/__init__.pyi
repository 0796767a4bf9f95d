from .camera_image import CameraImage as CameraImage
from .camera_to_xyz import to_xyz as to_xyz
from .levels import Levels as Levels
from .linear_files import write_camera_exr as write_camera_exr
from .options import DevelopOptions as DevelopOptions
from .photograph import DevelopedPhotograph as DevelopedPhotograph
from .photograph import develop_photographs as develop_photographs
from .read import read_camera_image as read_camera_image
