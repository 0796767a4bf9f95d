from .checklist import METHODS_ITEMS as METHODS_ITEMS
from .grouped import common_names as common_names
from .page import write_report as write_report
from .report import Report as Report
from .report import describe as describe
from .report import print_report as print_report
from .sections.series import rating_figure as rating_figure
from .sections.series import score_figure as score_figure
