from .disparity import Viewing as Viewing
from .homography import homography_from_points as homography_from_points
from .pair import align_pair as align_pair
from .registration import register as register
from .straightening import straighten as straighten
from .toe_in import focal_px as focal_px
from .toe_in import rectify_toe_in as rectify_toe_in
from .warping import warp as warp
