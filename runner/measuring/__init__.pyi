from .options import Dialogue as Dialogue
from .options import InstrumentOptions as InstrumentOptions
from .options import PatchOptions as PatchOptions
from .options import ShowOptions as ShowOptions
from .show_patches import plan_patches as plan_patches
from .show_patches import show_plan as show_plan
from .station import measure_display as measure_display
from .verification import verify_display as verify_display
