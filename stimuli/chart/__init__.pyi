from .camera_fit import ChartFit as ChartFit
from .camera_fit import fit_camera_to_chart as fit_camera_to_chart
from .options import ChartOptions as ChartOptions
