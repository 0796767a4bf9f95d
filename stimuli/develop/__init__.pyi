from .camera_to_xyz import Negative as Negative
from .levels import Levels as Levels
from .photograph import DevelopedPhotograph as DevelopedPhotograph
from .photograph import DevelopOptions as DevelopOptions
from .photograph import develop_photographs as develop_photographs
from .raw_files import Demosaic as Demosaic
