"""What the stimuli's factors, such as view and exposure, do to the scores: strengths θ = X β [Springall1973].

`values` reads the factors of the stimuli; `terms` turns a factor into columns of X; `aliasing` chooses those that the
comparisons can distinguish; `separation` reports effects without a finite maximum; `fit` maximises the likelihood;
`likelihood_ratio` and `explained` compare models; `effects` puts all together; `figure` draws, and `report` tells.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
