"""What the factors do to the scores, with all tests: the result of a fit."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal, TypeAlias

import numpy as np

from analysis.classes import Conclusion, two_sided_p
from analysis.scaling import FEWEST_OBSERVERS, Maximised, t_quantile
from documents.arrays import Floats
from documents.text import JsonResult
from extensions.factors.explained import Explained
from extensions.factors.likelihood_ratio import FactorTest, InteractionTest
from extensions.factors.terms import Coding
from extensions.factors.values import Factor, Omitted

FactorMethod = Literal["ml", "map"]
UNDER_A_PRIOR = "Under a prior all effects are finite, but untested: type cyclopean.effects(FOLDER, method='map')."


@dataclass(frozen=True, slots=True)
class Effect(JsonResult):
    """The effect of a level, or of a number, on the strength.

    Attributes
    ----------
    factor, level
        Its factor and level; for numbers the level is "per unit" or "per doubling".
    reference
        The level with which it is compared; None for numbers and for sum coding, where it is the mean of all levels.
    estimate
        In nats.
    se, low, high, p
        Standard error by the model, 95 % interval and two-sided p of no effect, by `analysis.scaling.profile` and the
        normal law.
    robust_se, robust_low, robust_high, robust_p
        The same by the sandwich clustered by observer, with Student's law of one degree of freedom less than there
        are observers [Cameron2015]; None with fewer than two observers, or where they hardly differ.

    Under a prior, above 200 items, and where answers weigh less than Firth's term, both are by standard errors alone.
    """

    factor: str
    level: str
    reference: str | None
    estimate: float
    se: float
    low: float
    high: float
    p: float
    robust_se: float | None
    robust_low: float | None
    robust_high: float | None
    robust_p: float | None
    json_also: ClassVar = ("odds_factor",)

    @property
    def odds_factor(self) -> float:
        """What the effect multiplies the odds of being preferred by: exp(estimate), infinite if too large."""
        with np.errstate(over="ignore"):
            return float(np.exp(self.estimate))


# The ends of an effect's 95 % interval in nats, and the two-sided p of no effect.
Tested: TypeAlias = tuple[float, float, float]


def by_standard_error(estimate: float, se: float, df: float | None) -> Tested:
    """Test an effect by its standard error, with the normal law or Student's of ``df`` degrees of freedom."""
    reach = t_quantile(math.inf if df is None else df) * se
    p = float(two_sided_p(np.array(abs(estimate) / se), df))
    return estimate - reach, estimate + reach, p


def effect(
    term: tuple[str, str, str | None], estimate: float, se: float, plain: Tested, robust: tuple[float, Tested] | None
) -> Effect:
    """Return the effect of a factor's level beside its reference; ``robust`` has the standard error by observers."""
    by_observers = (None, None, None, None) if robust is None else (robust[0], *robust[1])
    return Effect(*term, estimate, se, *plain, *by_observers)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FactorEffects(Maximised, JsonResult):
    """What the factors do to the strengths of ``n`` items, and whether it can be trusted.

    Attributes
    ----------
    items
        Names of the items.
    factors
        The factors in the model, in order, with their levels, the reference first.
    left_out
        The others, and why each is constant, unknown of some items, or aliased.
    coding, method
        What was asked for.
    effects
        One for each level, or number; empty where there is no finite maximum.
    sandwich_covariance
        Shape (e, e): of all effects together, in nats², by observers, as ``joint_covariance`` is by the model; None
        with fewer than two.
    tests, interactions
        Likelihood-ratio tests of type II; empty unless ``method`` is ``ml``.
    explained
        Share of the free scores and lack of fit; None where there is no finite maximum.
    observers
        How many observers gave answers that count.
    separation
        Sentences why there is no finite maximum; empty if the fit is sound.
    held_by_prior
        The same sentences where only the prior keeps the effects finite.
    """

    items: tuple[str, ...]
    factors: tuple[Factor, ...]
    left_out: tuple[Omitted, ...]
    coding: Coding
    method: FactorMethod
    effects: tuple[Effect, ...]
    sandwich_covariance: Floats | None
    tests: tuple[FactorTest, ...]
    interactions: tuple[InteractionTest, ...]
    explained: Explained | None
    observers: int
    separation: tuple[str, ...]
    held_by_prior: tuple[str, ...]
    json_names: ClassVar = (
        "coding method prior_sd factors left_out effects tests interactions conclusions cautions explained "
        "fitted_items log_likelihood observers converged iterations separation held_by_prior ties_left_out"
    )
    json_keys: ClassVar = {"fitted_items": "items"}

    @property
    def problem_lines(self) -> tuple[str, ...]:
        """Why there are no finite effects, and what to type; empty where there are."""
        return (*self.separation, UNDER_A_PRIOR) if self.separation else ()

    @property
    def cautions(self) -> tuple[str, ...]:
        """Which main effects are averages over the levels of a factor that they interact with, in sentences."""
        found = [test for test in self.interactions if test.conclusion.verdict == "distinguished"]
        sentences = []
        for factor in self.factors:
            others = [name for test in found if factor.name in test.names for name in test.names if name != factor.name]
            if others:
                over = " and ".join(f"'{name}'" for name in others)
                sentences.append(
                    f"The effect of '{factor.name}' is an average over the levels of {over}, with which it interacts: "
                    "read the scores of each combination."
                )
        return tuple(sentences)

    @property
    def by_observers(self) -> bool:
        """Whether intervals to read are those by observers, as verdicts are: with five observers or more who differ."""
        return self.observers >= FEWEST_OBSERVERS and all(effect.robust_se is not None for effect in self.effects)

    def interval(self, effect: Effect) -> tuple[float, float]:
        """Return the 95 % interval of ``effect``, in nats: by observers where the verdict is."""
        if self.by_observers and effect.robust_low is not None and effect.robust_high is not None:
            return effect.robust_low, effect.robust_high
        return effect.low, effect.high

    @property
    def conclusions(self) -> tuple[Conclusion, ...]:
        """What is concluded of each factor and each interaction; an estimate where a factor is one number."""
        mains = [self._of_factor(test) for test in self.tests]
        return (*mains, *(test.conclusion for test in self.interactions if test.p is not None))

    def _of_factor(self, test: FactorTest) -> Conclusion:
        own = [effect for effect in self.effects if effect.factor == test.name]
        if len(own) != 1:
            return test.conclusion
        low, high = self.interval(own[0])
        unit = "nats" if own[0].reference else f"nats {own[0].level}"
        return replace(test.conclusion, estimate=own[0].estimate, low=low, high=high, unit=unit)

    @property
    def fitted_items(self) -> list[dict[str, Any]]:
        """The strength of each item by its factors, and that of its own."""
        free = self.explained.free_theta if self.explained else self.theta
        rows = zip(self.items, self.theta, free, strict=True)
        return [{"name": name, "fitted": fitted, "free": own} for name, fitted, own in rows]
