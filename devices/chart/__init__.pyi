from .layout import COLORCHECKER as COLORCHECKER
from .layout import ChartLayout as ChartLayout
from .layout import patch_quadrangles as patch_quadrangles
from .layout import perspective as perspective
from .layout import project as project
from .way_round import MOST_OFF as MOST_OFF
from .way_round import WAYS as WAYS
from .way_round import misfit as misfit
