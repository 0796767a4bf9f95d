from .camera_fit import fit_camera_to_chart as fit_camera_to_chart
from .camera_fit import is_table as is_table
