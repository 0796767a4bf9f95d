from .doctor import REGISTRIES as REGISTRIES
from .error_budget import rig_budget as rig_budget
from .files import check_file as check_file
from .report import TRIED_OBSERVERS as TRIED_OBSERVERS
from .report import CheckOptions as CheckOptions
from .report import CheckReport as CheckReport
