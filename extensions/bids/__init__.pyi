from .export import About as About
from .export import Export as Export
from .export import export_dataset as export_dataset
from .results import export_results as export_results
from .text import unescape as unescape
