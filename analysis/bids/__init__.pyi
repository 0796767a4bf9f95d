from .dataset import About as About
from .export import Export as Export
from .export import export_dataset as export_dataset
from .text import unescape as unescape
