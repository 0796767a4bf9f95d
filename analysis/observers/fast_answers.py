"""Whether answers may be none to what was shown: presses ignored in most trials, or answers faster than anyone's."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from analysis.kinds.trial import Trial

TOO_FAST_S = 0.2
FEWEST_TRIALS = 10
STRIKING_SHARE = 0.5


@dataclass(slots=True)
class FastAnswers:
    """Of a session's ``trials``: in how many presses were ``ignored``, and how many were answered too ``fast``."""

    trials: int = 0
    ignored: int = 0
    fast: int = 0

    @classmethod
    def of(cls, trials: Iterable[Trial]) -> FastAnswers:
        """Return the counts of ``trials``."""
        haste = cls()
        for trial in trials:
            haste.add(trial)
        return haste

    def add(self, trial: Trial) -> None:
        """Count a trial; pages of words and outcomes of tests are none."""
        if trial.is_page or trial.is_outcome:
            return
        self.trials += 1
        # A key that means nothing there was never meant for another scene.
        self.ignored += any(why != "no_meaning" for _, _, why in trial.ignored)
        self.fast += trial.response_time_s < TOO_FAST_S

    @property
    def striking(self) -> bool:
        """Whether presses were ignored, or answers fast, in half of the trials or more, of which there are ten."""
        least = STRIKING_SHARE * self.trials
        return self.trials >= FEWEST_TRIALS and (self.ignored >= least or self.fast >= least)

    @property
    def words(self) -> str:
        """All of it in a sentence."""
        return (
            f"presses were ignored in {self.ignored} of {self.trials} trials, and {self.fast} answers took less than "
            f"{TOO_FAST_S:g} s: they may be no answers to what was shown"
        )
