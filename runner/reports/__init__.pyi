from .demo import Demo as Demo
from .demo import run_demo as run_demo
from .power import PowerOptions as PowerOptions
from .power import PowerStudy as PowerStudy
from .power import study_power as study_power
from .results import ReportOptions as ReportOptions
from .results import report_results as report_results
from .screens import preview as preview
