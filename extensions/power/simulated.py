"""The power of studies by simulation, with several numbers of observers."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from analysis.choices import REPLICATES, SEED
from analysis.simulation import Plan, StudyTally, blocks_of, simulate, summed
from documents import one_blas_thread
from documents.arrays import Floats
from extensions.power.compute import Done, compute
from extensions.power.results import Power


@one_blas_thread()
def simulate_power(
    plan: Plan,
    observers: Sequence[int],
    *,
    replicates: int = REPLICATES,
    seed: int = SEED,
    scheduler: str | None = None,
    workers: int | None = None,
    done: Done | None = None,
    note: Callable[[str], None] | None = None,
) -> Power:
    """Simulate studies with each number of ``observers``.

    The results depend on the plan and the seed alone: not on ``scheduler`` or ``workers`` (see
    `extensions.power.compute.compute`), nor on which other numbers of observers are simulated.

    Parameters
    ----------
    plan
        The design, the assumed scores, and the tests.
    observers
        Numbers of observers to simulate.
    replicates
        Number of simulated studies for each number of observers.
    seed
        Random seed.
    scheduler, workers, done, note
        As for `extensions.power.compute.compute`.

    Returns
    -------
    The power with each number of observers, with Monte-Carlo standard errors.

    Raises
    ------
    ResultsError
        If the plan or a number is out of range, or no study of some size has a fit.
    ComputeError
        As `extensions.power.compute.compute`.

    Examples
    --------
    >>> from extensions.power import differing_pairs
    >>> theta = np.array([1.0, 0.0, -1.0])
    >>> plan = Plan(("a", "b", "c"), theta, times=np.ones(3, dtype=int), differs=differing_pairs(theta))
    >>> power = simulate_power(plan, [10, 40], replicates=200, workers=1)
    >>> power.pair_names[1], bool((power.separates[1] > power.separates[0]).all())
    (('a', 'c'), True)
    """
    sizes = sorted(set(observers))
    blocks = blocks_of(plan, sizes, replicates, seed)
    tallies = summed(blocks, compute(simulate, blocks, scheduler=scheduler, workers=workers, done=done, note=note))
    return _power(plan, replicates, seed, tuple(sizes), [tallies[size] for size in sizes])


def _power(plan: Plan, replicates: int, seed: int, sizes: tuple[int, ...], tallies: Sequence[StudyTally]) -> Power:
    fitted = np.array([[tally.replicates - tally.unfitted] for tally in tallies], dtype=np.float64)
    count = fitted[:, 0]
    right = np.array([tally.right for tally in tallies])
    recovered = np.array([tally.recovered for tally in tallies], dtype=np.float64)
    alike, alike_squares = (np.array([getattr(t, name) for t in tallies]) for name in ("alike", "alike_squares"))
    width, width_squares = (np.array([getattr(t, name) for t in tallies]) for name in ("width", "width_squares"))
    widths, width_errors = width / fitted, _error_of_mean(width, width_squares, fitted)
    return Power(
        plan=plan,
        replicates=replicates,
        seed=seed,
        observers=sizes,
        separates=right / fitted,
        separates_error=_error_of_share(right, fitted),
        reversed=np.array([tally.wrong for tally in tallies]) / fitted,
        recovery=recovered / count,
        recovery_error=_error_of_share(recovered, count),
        alike=alike / count,
        alike_error=_error_of_mean(alike, alike_squares, count),
        width=widths[:, :-1],
        width_error=width_errors[:, :-1],
        mean_width=widths[:, -1],
        mean_width_error=width_errors[:, -1],
        separated=np.array([tally.separated for tally in tallies]) / count,
        unfitted=np.array([tally.unfitted / tally.replicates for tally in tallies]),
    )


def _error_of_share(times: Floats, count: Floats) -> Floats:
    """Return √(p (1 − p) / count), with a success and a failure added: never 0, even for none or all."""
    p = (times + 1) / (count + 2)
    return np.asarray(np.sqrt(p * (1 - p) / (count + 3)))


def _error_of_mean(total: Floats, squares: Floats, count: Floats) -> Floats:
    variance = (squares - total**2 / count) / (count - 1)
    return np.asarray(np.sqrt(np.maximum(variance, 0) / count))
