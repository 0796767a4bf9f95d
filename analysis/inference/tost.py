"""Are two items alike for practical purposes? Two one-sided tests on the scale of the strengths [Schuirmann1987].

A difference that is not significant is no evidence of no difference. Two items are *equivalent* where two hypotheses
are both refused, that θ_i − θ_j is at least the margin and that it is at most its negative; the p value is the larger
of the two. They are *distinguished* where the hypothesis of no difference is refused, as for the classes. What is
neither is *not distinguished*: there are too few answers to say. p values of both kinds are corrected for the number of
pairs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, get_args

import numpy as np

from analysis.choices import Adjust
from analysis.classes.classes import check_level
from analysis.classes.conclusions import Verdict, verdict_of
from analysis.classes.multiplicity import corrected
from analysis.errors import ResultsError
from analysis.inference.differences import differences
from analysis.scaling.laws import LAWS, MARGINS, parse_margin
from analysis.scaling.scores import Scores
from documents import Finding
from documents.text import JsonResult


@dataclass(frozen=True, slots=True)
class PairEquivalence(JsonResult):
    """Verdict on one pair.

    Attributes
    ----------
    first, second
        Names of the items; ``first`` has the higher strength.
    difference
        θ_first − θ_second, in the units of the strengths.
    p_equivalent, p_different
        Corrected p values: of the two one-sided tests, and of no difference.
    verdict
        ``equivalent``, ``distinguished`` or ``not distinguished``. A pair that is both different from 0 and within the
        margin is ``equivalent``; ``is_different`` then says that there is a difference, smaller than the margin.
    is_different
        Whether the difference from 0 is significant.
    """

    first: str
    second: str
    difference: float
    p_equivalent: float
    p_different: float
    verdict: Verdict
    is_different: bool


@dataclass(frozen=True, slots=True)
class Equivalence(JsonResult):
    """Verdicts on every pair.

    ``margin`` is in the units of the strengths, ``margin_text`` as it was named; ``margin_probability`` is the chance
    that belongs to it: of two items that far apart the better one is preferred so often.
    """

    pairs: tuple[PairEquivalence, ...]
    margin: float
    margin_text: str
    margin_probability: float
    alpha: float
    adjust: Adjust
    json_keys: ClassVar = {"counts": "*"}
    json_names: ClassVar = "margin margin_text margin_probability alpha adjust counts pairs"

    def count(self, verdict: Verdict) -> int:
        """Return how many pairs have this verdict."""
        return sum(pair.verdict == verdict for pair in self.pairs)

    @property
    def sentence(self) -> str:
        """How many pairs have which verdict."""
        return (
            f"Within ± {self.margin_text}: {self.count('equivalent')} of {len(self.pairs)} pairs are equivalent, "
            f"{self.count('distinguished')} distinguished, {self.count('not distinguished')} not distinguished."
        )

    @property
    def counts(self) -> dict[str, int]:
        """How many pairs each verdict has."""
        return {verdict.replace(" ", "_"): self.count(verdict) for verdict in get_args(Verdict)}


def equivalence(
    scores: Scores, margin: float | str, *, alpha: float | None = None, adjust: Adjust | None = None
) -> Equivalence:
    """Test every two items for equivalence by two one-sided tests [Schuirmann1987], beside the test of a difference.

    Parameters
    ----------
    scores
        Scores of paired comparisons, by any law.
    margin
        The largest difference that does not matter: a text as `parse_margin` reads it, or a number in the units of the
        strengths. Name it before you look at the answers.
    alpha, adjust
        Level, and correction for the number of pairs: ``none``, ``holm`` or ``bh``; those of the classes where None
        (``holm`` where the classes have ``maxz``).

    Returns
    -------
    Equivalence
        A verdict for each pair, pairs of the best item first.

    Raises
    ------
    ResultsError
        If the margin or a choice is none of these, or there are no finite strengths.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from analysis.scaling import score
    >>> alike = score(from_answers([Answer("a", "b", 500), Answer("b", "a", 490)]))
    >>> equivalence(alike, "0.5jnd").pairs[0].verdict, equivalence(alike, "51:49").pairs[0].verdict
    ('equivalent', 'not distinguished')
    """
    model = scores.fit.model
    text = margin if isinstance(margin, str) else f"{margin:g} {'sd' if model == 'thurstone' else 'nats'}"
    limit = parse_margin(margin, model) if isinstance(margin, str) else float(margin)
    if not (math.isfinite(limit) and limit > 0):
        raise ResultsError(Finding(f"the margin is {limit:g}", remedy=MARGINS))
    classes = scores.classes
    level = alpha if alpha is not None else classes.alpha if classes else 0.05
    own: Adjust = "holm" if classes is None or classes.adjust == "maxz" else classes.adjust
    correction = own if adjust is None else adjust
    check_level(level)
    if correction not in ("none", "holm", "bh"):
        what = f"equivalence tests have no correction '{correction}'"
        raise ResultsError(Finding(what, remedy="expected one of: none, holm, bh"))
    apart = differences(scores)
    p_different = corrected(apart.two_sided.copy(), correction)
    p_equivalent = corrected(np.maximum(apart.above(-limit), apart.below(limit)), correction)
    names = scores.comparisons.items
    pairs = []
    for row, (better, worse) in enumerate(zip(apart.first.tolist(), apart.second.tolist(), strict=True)):
        within, differs = bool(p_equivalent[row] <= level), bool(p_different[row] <= level)
        verdict: Verdict = "equivalent" if within else verdict_of(differs)
        difference = float(apart.estimate[row])
        numbers = float(p_equivalent[row]), float(p_different[row])
        pairs.append(PairEquivalence(names[better], names[worse], difference, *numbers, verdict, differs))
    return Equivalence(tuple(pairs), limit, text, LAWS[model].chance(limit), level, correction)
