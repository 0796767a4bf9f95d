from .saturation import tone_mapping as tone_mapping
from .scale import factor_to as factor_to
from .scale import mean_luminance_cd_m2 as mean_luminance_cd_m2
from .scale import scaled_picture as scaled_picture
from .scale import white_luminance_cd_m2 as white_luminance_cd_m2
from .statistics import picture_statistics as picture_statistics
