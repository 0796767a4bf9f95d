"""The promises of every law of choice, tried on one: its chances, its likelihood and its slopes are of one law."""

from __future__ import annotations

import numpy as np

from analysis.comparisons import Answer, from_answers
from analysis.scaling import LAWS, Counts, Law, Slopes, fit_model
from cyclopean.testing.promises import kept
from documents.arrays import Floats

# Differences in JNDs; from the last ones on no answer is any surprise.
_NEAR_JND = np.linspace(-4.0, 4.0, 33)
_FAR_JND = np.array([-80.0, -20.0, 20.0, 80.0])
_STRENGTHS_JND = np.array([1.5, 0.25, -0.5, -1.25])
_BESIDE = 1e-5  # by which slopes are found: to about 1e-9 of the first, 1e-5 of what grows with the slope


def prove_scaling(name: str, *, law: Law | None = None) -> tuple[str, ...]:
    """Prove that a law of choice keeps what the analysis takes for granted of every law.

    Parameters
    ----------
    name
        What is typed after ``--model``.
    law
        The law, where its package is not installed.

    Returns
    -------
    tuple of str
        The promises that it kept.

    Raises
    ------
    BrokenPromiseError
        If a promise is not kept.
    InputError
        If nobody offers that law.

    Examples
    --------
    >>> "its slopes are those of its likelihood" in prove_scaling("thurstone")
    True
    """
    with LAWS.trying(name, law):
        tried = _Tried(name, LAWS.wanted(name, "model"))
        return kept(
            {
                "the chances of an answer sum to 1": tried.sums,
                "both sides are alike": tried.mirrored,
                "what is stronger is preferred more often": tried.rising,
                "one JND is 75 : 25": tried.jnd,
                "its likelihood is that of its chances": tried.likelihood,
                "its slopes are those of its likelihood": tried.slopes,
                "its likelihood has one maximum": tried.concave,
                "far out everything is a number": tried.far,
                "strengths come back from answers": tried.recovered,
            }
        )


class _Tried:
    """A law, differences in its unit, and counts of pairs; each attempt returns what broke."""

    def __init__(self, name: str, law: Law) -> None:
        self._name, self._law = name, law
        self._d = _NEAR_JND[None] * self._law.jnd
        self._k: tuple[Floats, ...] = tuple(np.full((1, 1), k) for k in ((0.3, 0.9) if self._law.parameter else (0.0,)))
        self._counts = _counts(self._d.shape[1], ties=self._law.parameter is not None)

    def sums(self) -> str | None:
        for k in self._k:
            off = np.abs(sum(self._law.probabilities(self._d, k)) - 1).max()
            if not off <= 1e-12:
                return f"they are off by {off:.2g}"
        return None

    def mirrored(self) -> str | None:
        for k in self._k:
            ahead, back = (self._law.probabilities(d, k) for d in (self._d, -self._d))
            if not all(
                np.allclose(one, other, atol=1e-12)
                for one, other in zip(ahead, (back[1], back[0], back[2]), strict=True)
            ):
                return "the first of two is not preferred as the second is"
        return None

    def rising(self) -> str | None:
        rises = all((np.diff(self._law.probabilities(self._d, k)[0]) > 0).all() for k in self._k)
        return None if rises else "the chance falls somewhere"

    def jnd(self) -> str | None:
        chance, difference = self._law.chance(self._law.jnd), self._law.difference(0.75)
        if not abs(chance - 0.75) <= 1e-9:
            return f"at jnd = {self._law.jnd:.6g} it is {chance:.4f}"
        near = abs(difference - self._law.jnd) <= 1e-9 * self._law.jnd
        return None if near else f"difference(0.75) is {difference:.6g}"

    def likelihood(self) -> str | None:
        counts = self._counts
        for k in self._k:
            first, second, neither = self._law.probabilities(self._d, k)
            wanted = counts.won * np.log(first) + counts.lost * np.log(second)
            wanted += counts.tied * np.log(neither) if self._law.parameter else 0.0
            off = np.abs(self._law.log_likelihood(counts, self._d, k) - wanted).max()
            if not off <= 1e-9:
                return f"they differ by {off:.2g}"
        return None

    def slopes(self) -> str | None:
        for k in self._k:
            told = self._law.slopes(self._counts, self._d, k)
            pairs = {"d": (told.d, self._by("d", k, None)), "dd": (told.dd, -self._by("d", k, "d"))}
            if self._law.parameter:
                pairs |= {"k": (told.k, self._by("k", k, None)), "kk": (told.kk, -self._by("k", k, "k"))}
                pairs["dk"] = (told.dk, -self._by("k", k, "d"))
            for which, (said, seen) in pairs.items():
                if not np.allclose(said, seen, rtol=1e-5, atol=1e-6):
                    worst = int(np.abs(said - seen).argmax())
                    place, one, other = (float(of[0, worst]) for of in (self._d, said, seen))
                    return f"{which} is {one:.6g} at d = {place:.3g}, where it is {other:.6g}"
        return None

    def _by(self, which: str, k: Floats, of: str | None) -> Floats:
        """Return the derivative by ``d`` or ``k`` of the likelihood, or ``of`` one of its slopes."""
        d_step, k_step = (_BESIDE, 0.0) if which == "d" else (0.0, _BESIDE)
        sides = [self._at(self._d + sign * d_step, k + sign * k_step, of) for sign in (1, -1)]
        return np.asarray((sides[0] - sides[1]) / (2 * _BESIDE))

    def _at(self, d: Floats, k: Floats, of: str | None) -> Floats:
        if of is None:
            return self._law.log_likelihood(self._counts, d, k)
        return np.asarray(getattr(self._law.slopes(self._counts, d, k), of))

    def concave(self) -> str | None:
        for k in self._k:
            bends: Slopes = self._law.slopes(self._counts, self._d, k)
            if (bends.dd < -1e-12).any() or (bends.dd * bends.kk - bends.dk**2 < -1e-9).any():
                return "it bends upwards somewhere"
        return None

    def far(self) -> str | None:
        d = _FAR_JND[None] * self._law.jnd
        counts = _counts(d.shape[1], ties=self._law.parameter is not None)
        for k in self._k:
            for what, values in (
                ("chances", self._law.probabilities(d, k)),
                ("slopes", self._law.slopes(counts, d, k)),
            ):
                if not all(np.isfinite(part).all() for part in values):
                    return f"{what} are not finite"
        return None

    def recovered(self) -> str | None:
        strengths, k = _STRENGTHS_JND * self._law.jnd, self._k[0]
        names, answers = "abcd", []
        for i, j in zip(*np.triu_indices(4, 1), strict=True):
            first, second, neither = (
                float(p[0, 0]) for p in self._law.probabilities(np.full((1, 1), strengths[i] - strengths[j]), k)
            )
            answers += [Answer(names[i], names[j], 1000 * first), Answer(names[j], names[i], 1000 * second)]
            answers += [Answer(names[i], names[j], 1000 * neither, tie=True)] if self._law.parameter else []
        fit = fit_model(from_answers(answers), self._name)
        off = float(np.abs(fit.theta - strengths).max()) / self._law.jnd
        return None if fit.converged and off <= 1e-6 else f"they are off by {off:.2g} JND"


def _counts(pairs: int, *, ties: bool) -> Counts:
    """Return counts of so many pairs, no two of them alike."""
    won, lost = (np.linspace(low, high, pairs)[None] for low, high in ((3.0, 9.0), (8.0, 2.0)))
    first = np.zeros(pairs, dtype=np.intp)
    return Counts(2, first, first + 1, won, lost, np.full((1, pairs), 2.5 if ties else 0.0))
