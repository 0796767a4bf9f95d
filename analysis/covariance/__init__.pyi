from .laplacian import ROUNDING as ROUNDING
from .laplacian import contrast_variances as contrast_variances
from .laplacian import pair_variances as pair_variances
from .laplacian import pseudo_inverse as pseudo_inverse
from .laplacian import solve as solve
from .shrinkage import Clustered as Clustered
from .shrinkage import Spread as Spread
from .shrinkage import shrink as shrink
