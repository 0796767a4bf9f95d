"""Bradley-Terry strengths under a Gaussian prior: finite, with a covariance, for any answers, even for none.

Each θ_i is normal about 0 with standard deviation σ. The posterior's mode is found by Newton's method, and its
covariance is taken from the curvature there (Laplace's approximation), on strengths that sum to zero, as
`analysis.scaling.penalty` says.

σ itself is learnt from the answers (empirical Bayes), by the fixed point of [MacKay1992]: σ² is the sum of squares of
the strengths over as many of them as the answers determine, n − 1 − Σ var θ / σ². Without that, answers to pairs that
were chosen for being close make strengths seem further apart than they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.scaling.counts import Counts
from analysis.scaling.designs import ITEMS
from analysis.scaling.laplacian import contrast_variances
from analysis.scaling.laws import LOGISTIC
from analysis.scaling.newton import joint_covariance, maximise
from analysis.scaling.penalty import Gaussian

Floats = NDArray[np.float64]

# As if so many more strengths of such a size had been seen: σ stays above zero and finite for any answers.
PRIOR_ITEMS, PRIOR_SIZE, WIDEST_SD = 1.0, 1.5, 10.0
SPREAD_TOLERANCE = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """The strengths in nats after some answers, and how they were computed.

    Attributes
    ----------
    theta, covariance
        Shapes (n,) and (n, n): mode, with mean 0, and covariance on strengths that sum to zero.
    prior_sd
        σ in nats.
    log_likelihood
        Σ W log p at the mode.
    iterations, converged
        Newton steps taken, and whether the last one was below the tolerance.
    """

    theta: Floats
    covariance: Floats
    prior_sd: float
    log_likelihood: float
    iterations: int
    converged: bool

    def contrasts(self) -> tuple[Floats, Floats]:
        """Return mean and variance of θ_i − θ_j, each of shape (n, n)."""
        return self.theta[:, None] - self.theta[None, :], contrast_variances(self.covariance)


def posterior(wins: Floats, prior_sd: float) -> Posterior:
    """Return the posterior of the strengths.

    Parameters
    ----------
    wins
        Shape (n, n): ``wins[i, j]`` is how often item i was preferred over item j; any counts, also none.
    prior_sd
        σ in nats, above zero.
    """
    return _posterior(Counts.from_wins(wins[None]), prior_sd, None)


def learnt_posterior(wins: Floats, before: Posterior | None = None, most_steps: int = 500) -> Posterior:
    """Return the posterior of the strengths under a prior whose standard deviation is learnt from the answers too.

    Parameters
    ----------
    wins
        Shape (n, n): as for `posterior`.
    before
        Where to begin, such as the posterior before the last few answers.
    most_steps
        Steps after which σ is taken as it is, if it still moves by more than 1e-4 of it; ``converged`` says so.

    Returns
    -------
    Posterior
        Mode, shape (n,), and covariance, shape (n, n), of the strengths in nats, with the σ that was learnt.

    Examples
    --------
    >>> import numpy as np
    >>> after = learnt_posterior(np.array([[0.0, 3, 3], [0, 0, 3], [0, 0, 0]]))  # each better item always won
    >>> bool(np.isfinite(after.theta).all()), after.converged
    (True, True)
    """
    counts = Counts.from_wins(wins[None])
    after = _posterior(counts, before.prior_sd, before.theta) if before else _posterior(counts, PRIOR_SIZE, None)
    for _ in range(most_steps):
        squares = float((after.theta**2).sum()) + PRIOR_ITEMS * PRIOR_SIZE**2
        unknown = float(np.trace(after.covariance)) / after.prior_sd**2
        prior_sd = min(float(np.sqrt(squares / (counts.n - 1 - unknown + PRIOR_ITEMS))), WIDEST_SD)
        settled = abs(prior_sd / after.prior_sd - 1) < SPREAD_TOLERANCE
        after = _posterior(counts, prior_sd, after.theta)
        if settled:
            return after
    return replace(after, converged=False)


def _posterior(counts: Counts, prior_sd: float, start: Floats | None) -> Posterior:
    penalty = Gaussian.of_sd(prior_sd)
    top = maximise(counts, penalty=penalty, design=ITEMS, start=None if start is None else start[None])
    return Posterior(
        theta=top.theta[0],
        covariance=joint_covariance(counts, LOGISTIC, top.point, penalty)[0],
        prior_sd=prior_sd,
        log_likelihood=float(top.log_likelihood[0]),
        iterations=int(top.iterations[0]),
        converged=bool(top.converged[0]),
    )
