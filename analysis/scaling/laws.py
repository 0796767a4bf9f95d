"""Laws of paired comparison: from a difference of strengths to the chances of each answer.

- `Logistic`, Bradley and Terry's: p = 1 / (1 + exp(−d)) [Bradley1952].
- `Probit`, Thurstone's law of comparative judgement, Case V: p = Φ(d) [Thurstone1927]. Strengths are in standard
  deviations of the difference of two perceptions.
- `Davidson`, with ties: chances as exp(d/2) : exp(−d/2) : ν for first, second and neither [Davidson1970]. The parameter
  is k = log ν. With an order effect d holds δ, the log of the factor by which being shown first multiplies a strength
  [DavidsonBeaver1977]; their ν, which stands beside π_i and γ π_j, is this ν times the root of γ = exp(−δ).
- `RaoKupper`, with ties: neither is preferred where the perceived difference is below a threshold τ [Rao1967].
  p_first = 1 / (1 + exp(τ − d)), p_second = 1 / (1 + exp(τ + d)). As p_tie = (exp(2τ) − 1) p_first p_second, no near
  numbers are subtracted. The parameter is k = τ = log η.

Units of perceived difference: one JOD (just objectionable difference) is the difference at which three of four answers
prefer the better stimulus [PerezOrtiz2017]; one JND of ISO 20462 is the difference that gives 75 : 25 in paired
comparison as well [ISO20462]. They are the same length: 0.6745 standard deviations of a difference by Thurstone's law,
log 3 = 1.0986 nats by Bradley and Terry's.
"""

from __future__ import annotations

import math
import re
from abc import ABC, abstractmethod
from functools import cache
from typing import NamedTuple, get_args

import numpy as np

from analysis.choices import Model as Model
from analysis.choices import OwnModel
from analysis.errors import ResultsError
from analysis.scaling.counts import Counts
from documents import Finding
from documents.arrays import Floats
from documents.extensions import Registry

MODELS: tuple[Model, ...] = get_args(OwnModel)

STANDARD_DEVIATIONS_PER_JOD = 0.6744897501960817
NATS_PER_JND = 1.0986122886681098
JOD_PER_STANDARD_DEVIATION = 1 / STANDARD_DEVIATIONS_PER_JOD
# In an exponential family, along a step that changes the log odds of any two answers by at most r, the information
# grows at most as exp(r t) [Bach2010]; the likelihood then gains at least λ² (1 − (exp(r) − r − 1) / r²), λ² = g·s.
EXPONENTIAL_FAMILY_STEP = 1.79


_NOTHING: Floats = np.zeros((1, 1))
_NOTHING.flags.writeable = False


class Slopes(NamedTuple):
    """Derivatives of the log likelihood of each pair, each of the shape of the differences.

    ``d`` and ``k`` are the first ones by the difference and by the law's own parameter; ``dd``, ``dk`` and ``kk`` the
    second ones with their signs changed, so that they are information. A law without a parameter has no ``k``: zero.
    """

    d: Floats
    dd: Floats
    k: Floats = _NOTHING
    dk: Floats = _NOTHING
    kk: Floats = _NOTHING


class Law(ABC):
    """A law with at most one parameter ``k`` of its own, whose log likelihood is concave in difference and ``k``.

    ``d`` has the shape (B, m) of the counts, and ``k`` the shape (B, 1) or is a number.

    Attributes
    ----------
    jnd
        Length of one JND (75 : 25), which is one JOD, in the units of the strengths.
    unit
        Of the strengths: ``nats``, by which scores are shares that sum to 1, or another one, by which JOD are told.
    parameter
        Name of exp(k); None where the law has no parameter of its own, and no ties.
    safe_step
        Newton steps that change no pair's d by more, k's change added, cannot lower the likelihood; 0 if unknown.
    """

    jnd: float
    unit: str = "nats"
    parameter: str | None = None
    safe_step: float = 0.0

    def start(self, counts: Counts) -> Floats:
        """Return where ``k`` begins, shape (B, 1): 0 where there is no parameter."""
        return np.zeros((len(counts.won), 1))

    @abstractmethod
    def probabilities(self, d: Floats, k: Floats | float = 0.0) -> tuple[Floats, Floats, Floats]:
        """Return the chances that ``first`` is preferred, ``second``, and neither."""

    @abstractmethod
    def log_likelihood(self, counts: Counts, d: Floats, k: Floats | float = 0.0) -> Floats:
        """Return each pair's log likelihood without binomial coefficients; -inf where ``k`` is impossible."""

    @abstractmethod
    def slopes(self, counts: Counts, d: Floats, k: Floats | float = 0.0) -> Slopes:
        """Return the derivatives."""

    def difference(self, chance: float) -> float:
        """Return the difference at which, ties aside, the better item is preferred with ``chance``, 0.5 to 1."""
        from scipy.special import logit

        return float(logit(chance))

    def chance(self, difference: float) -> float:
        """Return the chance, ties aside, at a ``difference`` of at least 0."""
        law = LOGISTIC if self.parameter else self
        return float(law.probabilities(np.array([difference]))[0][0])

    def mean_over_observers(self, d: Floats, spread: float) -> Floats:
        """Return the chance of the first item, averaged over observers, at differences ``d`` of the typical observer.

        ``spread`` is the standard deviation of an item's strength between observers.
        """
        z, weight = _hermite()
        chances = self.probabilities(d[..., None] + np.sqrt(2) * spread * z, 0.0)[0]
        return np.asarray(chances @ (weight / weight.sum()))

    def flattening(self, spread: float) -> float:
        """Return the slope of `mean_over_observers` at equal strengths, a share (0 to 1) of the typical one's."""
        z, weight = _hermite()
        d = np.append(np.sqrt(2) * spread * z, 0.0)
        once = np.ones((1, len(d)))
        place = np.zeros(len(d), dtype=np.intp)
        counts = Counts(2, place, place + 1, once, 0 * once, 0 * once)
        slope = self.probabilities(d, 0.0)[0] * self.slopes(counts, d[None], 0.0).d[0]
        return float(slope[:-1] @ weight / weight.sum() / slope[-1])


@cache
def _hermite() -> tuple[Floats, Floats]:
    """Return nodes and weights for means over a normal distribution."""
    z, weight = np.polynomial.hermite_e.hermegauss(61)
    return z, weight


class Logistic(Law):
    """Without ties; strengths in nats."""

    jnd = NATS_PER_JND
    safe_step = EXPONENTIAL_FAMILY_STEP

    def probabilities(self, d: Floats, k: Floats | float = 0.0) -> tuple[Floats, Floats, Floats]:
        """Return the chances of ``first``, of ``second``, and 0."""
        p, q = _both(d)
        return p, q, np.zeros_like(d)

    def log_likelihood(self, counts: Counts, d: Floats, k: Floats | float = 0.0) -> Floats:
        """Return W log p of each pair."""
        terms: Floats = counts.won * np.minimum(d, 0) - counts.lost * np.maximum(d, 0)
        terms -= (counts.won + counts.lost) * np.log1p(np.exp(-np.abs(d)))
        return terms

    def slopes(self, counts: Counts, d: Floats, k: Floats | float = 0.0) -> Slopes:
        """Return the derivatives; all factors keep their relative precision however small they are."""
        p, q = _both(d)
        return Slopes(counts.won * q - counts.lost * p, (counts.won + counts.lost) * p * q)


def _both(d: Floats) -> tuple[Floats, Floats]:
    """Return 1 / (1 + exp(−d)) and 1 / (1 + exp(d))."""
    odds = np.exp(np.minimum(d, 700.0))  # which does not overflow
    q = 1 / (1 + odds)
    return odds * q, q


class Probit(Law):
    """Without ties; strengths in standard deviations of a difference."""

    jnd = STANDARD_DEVIATIONS_PER_JOD
    unit = "sd"

    def probabilities(self, d: Floats, k: Floats | float = 0.0) -> tuple[Floats, Floats, Floats]:
        """Return the chances of ``first``, of ``second``, and 0."""
        from scipy.special import ndtr

        return np.asarray(ndtr(d)), np.asarray(ndtr(-d)), np.zeros_like(d)

    def log_likelihood(self, counts: Counts, d: Floats, k: Floats | float = 0.0) -> Floats:
        """Return W log p of each pair."""
        from scipy.special import log_ndtr

        return np.asarray(_times(counts.won, log_ndtr(d)) + _times(counts.lost, log_ndtr(-d)))

    def slopes(self, counts: Counts, d: Floats, k: Floats | float = 0.0) -> Slopes:
        """Return the derivatives."""
        ahead, behind = self.hazard(d), self.hazard(-d)
        information = counts.won * ahead * (ahead + d) + counts.lost * behind * (behind - d)
        return Slopes(counts.won * ahead - counts.lost * behind, information)

    def difference(self, chance: float) -> float:
        """Return the difference at which the better item is preferred with ``chance``, 0.5 to 1."""
        from scipy.special import ndtri

        return float(ndtri(chance))

    @staticmethod
    def hazard(d: Floats) -> Floats:
        """Return φ(d) / Φ(d), to its relative precision however far out."""
        from scipy.special import log_ndtr

        return np.asarray(np.exp(-0.5 * d * d - 0.5 * np.log(2 * np.pi) - log_ndtr(d)))


def _times(count: Floats, log_p: Floats) -> Floats:
    return np.where(count > 0, count * log_p, 0.0)


class Davidson(Law):
    """With ties; strengths in nats, as Bradley and Terry's where there is no tie."""

    parameter = "nu"
    jnd = NATS_PER_JND
    safe_step = EXPONENTIAL_FAMILY_STEP

    def start(self, counts: Counts) -> Floats:
        """Return log ν of items that are all alike."""
        decided = (counts.won + counts.lost).sum(axis=1, keepdims=True)
        return np.asarray(np.log(2 * counts.tied.sum(axis=1, keepdims=True) / decided))

    def probabilities(self, d: Floats, k: Floats | float = 0.0) -> tuple[Floats, Floats, Floats]:
        """Return the chances of ``first``, ``second`` and neither."""
        first, second, neither = np.exp(_log_probabilities(d, k))
        return first, second, neither

    def log_likelihood(self, counts: Counts, d: Floats, k: Floats | float = 0.0) -> Floats:
        """Return W log p of each pair."""
        first, second, neither = _log_probabilities(d, k)
        return np.asarray(counts.won * first + counts.lost * second + counts.tied * neither)

    def slopes(self, counts: Counts, d: Floats, k: Floats | float = 0.0) -> Slopes:
        """Return the derivatives, no two near numbers subtracted."""
        p, q, t = self.probabilities(d, k)
        total = counts.total
        return Slopes(
            d=counts.won * (q + t / 2) - counts.lost * (p + t / 2) - counts.tied * (p - q) / 2,
            dd=total * (p * q + t * (p + q) / 4),
            k=counts.tied * (p + q) - (counts.won + counts.lost) * t,
            dk=-total * t * (p - q) / 2,
            kk=total * t * (p + q),
        )


def _log_probabilities(d: Floats, k: Floats | float) -> Floats:
    """Return log chances, shape (3, ...)."""
    weights = np.stack([d / 2, -d / 2, np.broadcast_to(k, d.shape)])
    weights -= weights.max(axis=0)
    return np.asarray(weights - np.log(np.exp(weights).sum(axis=0)))


class RaoKupper(Law):
    """With ties; strengths in nats."""

    parameter = "eta"
    jnd = NATS_PER_JND

    def start(self, counts: Counts) -> Floats:
        """Return τ of items that are all alike."""
        share = counts.tied.sum(axis=1, keepdims=True) / counts.total.sum(axis=1, keepdims=True)
        return np.asarray(np.log1p(share) - np.log1p(-share))

    def probabilities(self, d: Floats, k: Floats | float = 0.0) -> tuple[Floats, Floats, Floats]:
        """Return the chances of ``first``, ``second`` and neither."""
        from scipy.special import expit

        first, second = expit(d - k), expit(-d - k)
        return np.asarray(first), np.asarray(second), np.asarray(np.expm1(2 * k) * first * second)

    def log_likelihood(self, counts: Counts, d: Floats, k: Floats | float = 0.0) -> Floats:
        """Return W log p of each pair; -inf where the threshold is not above zero."""
        from scipy.special import log_expit

        possible = np.asarray(k) > 0
        k = np.where(possible, k, 1.0)
        neither = np.log(-np.expm1(-2 * k)) + log_expit(k - d) + log_expit(k + d)
        terms = counts.won * log_expit(d - k) + counts.lost * log_expit(-d - k) + counts.tied * neither
        return np.where(possible, terms, -np.inf)

    def slopes(self, counts: Counts, d: Floats, k: Floats | float = 0.0) -> Slopes:
        """Return the derivatives."""
        from scipy.special import expit

        first, second = counts.won + counts.tied, counts.lost + counts.tied
        p, not_p, q, not_q = expit(d - k), expit(k - d), expit(-d - k), expit(k + d)
        spread_first, spread_second = first * p * not_p, second * q * not_q
        return Slopes(
            d=counts.won * not_p - counts.lost * not_q + counts.tied * (q - p),
            dd=spread_first + spread_second,
            k=counts.tied * (p + q + 2 / np.expm1(2 * k)) - counts.won * not_p - counts.lost * not_q,
            dk=spread_second - spread_first,
            kk=spread_first + spread_second + counts.tied / np.sinh(k) ** 2,
        )


LOGISTIC, DAVIDSON, RAO_KUPPER, PROBIT = Logistic(), Davidson(), RaoKupper(), Probit()
# By the name of a model: ours, and those of other packages (`docs/extend.md`).
LAWS: Registry[Law] = Registry(
    "cyclopean.scalings",
    {
        "bradley-terry": "analysis.scaling.laws:LOGISTIC",
        "davidson": "analysis.scaling.laws:DAVIDSON",
        "rao-kupper": "analysis.scaling.laws:RAO_KUPPER",
        "thurstone": "analysis.scaling.laws:PROBIT",
    },
    lambda name, kind: None if isinstance(kind, Law) else "is no Law",
)


def models_beside(model: Model, *, ties: bool) -> list[Model]:
    """Return the names of our models, and of one more; without ``ties`` only of those that have none."""
    return [name for name in dict.fromkeys([*MODELS, model]) if ties or not LAWS[name].parameter]


def probabilities(theta: Floats) -> Floats:
    """Return p_ij, the chance that item i is preferred over item j by Bradley and Terry's law.

    Shapes (..., n) to (..., n, n).
    """
    from scipy.special import expit

    return np.asarray(expit(theta[..., :, None] - theta[..., None, :]))


def iso_20462_jnd(share: Floats) -> Floats:
    """Return the JNDs between two stimuli of which the better is preferred with ``share`` (0 to 1); −3 to 3.

    ISO 20462's angular law, (12/π) arcsin √p − 3, is for the share of a single pair; no scale here is fitted by it.
    """
    return 12 / np.pi * np.arcsin(np.sqrt(share)) - 3


MARGINS = "give a number of JND such as 0.5jnd, a chance such as 55:45 or 0.55, or nats such as 0.2nats"
_MARGIN = re.compile(r"\s*([0-9.eE+-]+)\s*(?:(jnd|jod|nats?|sd|%)|:\s*([0-9.eE+-]+))?\s*", re.IGNORECASE)


def parse_margin(text: str, model: Model = "bradley-terry") -> float:
    """Return a margin in the units of the strengths of ``model``.

    Parameters
    ----------
    text
        A number of just noticeable differences (``0.5jnd``, ``0.5jod``), a chance above one half (``55:45``, ``55%``,
        ``0.55``), or a difference of strengths (``0.2nats``; ``0.2sd`` for ``thurstone``).

    Raises
    ------
    ResultsError
        If it is none of these, or not above zero.

    Examples
    --------
    >>> round(parse_margin("0.5jnd"), 3), round(parse_margin("55:45"), 3), parse_margin("0.2nats")
    (0.549, 0.201, 0.2)
    """
    law, result = LAWS[model], _MARGIN.fullmatch(text)
    own = law.unit
    try:
        numbers = [float(part) for part in (result[1], result[3] or "0")] if result else []
    except ValueError:
        numbers = []
    if not (result and numbers and all(map(math.isfinite, numbers))):
        raise ResultsError(Finding(f"the margin is '{text}'", remedy=MARGINS))
    value, other = numbers
    unit = (result[2] or "").lower().removesuffix("s")
    if unit in ("jnd", "jod"):
        margin = value * law.jnd
    elif unit in ("nat", "sd"):
        if unit != own.removesuffix("s"):
            what = f"the margin is '{text}', and the strengths of the model '{model}' are in {own}"
            raise ResultsError(Finding(what, remedy=f"give it in {own}, in jnd, or as a chance such as 55:45"))
        margin = value
    else:
        chance = value / (value + other) if result[3] else value / 100 if unit == "%" else value
        if not 0.5 < chance < 1:
            raise ResultsError(Finding(f"the margin is '{text}'", remedy=MARGINS))
        margin = law.difference(chance)
    if not margin > 0:
        raise ResultsError(Finding(f"the margin is '{text}', not above zero", remedy=MARGINS))
    return float(margin)
