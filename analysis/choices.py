"""What may be chosen of an analysis, and its defaults: here, so that commands name them before numpy is there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, TypeAlias

from documents.options import Typed

OwnModel: TypeAlias = Literal["bradley-terry", "davidson", "rao-kupper", "thurstone"]
Model: TypeAlias = OwnModel | str  # another package may have it
DistancePrior: TypeAlias = Literal["gaussian", "bounded", "none"]
Adjust: TypeAlias = Literal["none", "holm", "bh", "maxz"]
CovarianceChoice: TypeAlias = Literal["auto", "model", "scaled", "sandwich", "shrinkage"]
Unscreened: TypeAlias = Literal["keep", "leave_out"]
Interval: TypeAlias = Literal["wald", "bootstrap"]
TARGET, REPLICATES, SEED = 0.8, 1000, 2016
"""Power that a pair should reach; studies simulated for each number of observers, and their random seed."""


@dataclass(frozen=True, slots=True)
class Filter:
    """The rule by which observers are left out; without arguments, nobody is.

    Attributes
    ----------
    without
        Observer to leave out; repeat for each.
    with_simulated
        Count simulated observers beside people; without it they count only where nobody else answered.
    screening
        Leave out observers who failed this test of vision, such as stereo_acuity; repeat for each. In Python, an empty
        tuple names every test that was taken.
    unscreened
        With --passed, also leave out observers who did not take the test.
    most_missed
        Leave out observers who missed more than this number of obvious catch trials.
    """

    without: Annotated[tuple[str, ...], Typed(metavar="OBSERVER")] = ()
    with_simulated: bool = False
    screening: Annotated[tuple[str, ...] | None, Typed("--passed", "TEST")] = None
    unscreened: Annotated[Unscreened, Typed("--screened", value="leave_out")] = "keep"
    most_missed: Annotated[int | None, Typed(least=0)] = None

    @property
    def sentence(self) -> str:
        """The rule in words, for a Methods paragraph."""
        rules = []
        if self.without:
            who = "observer" if len(self.without) == 1 else "observers"
            rules.append(f"{who} {', '.join(self.without)} left out by hand")
        if self.most_missed is not None:
            trials = f"{self.most_missed} obvious catch trial{'' if self.most_missed == 1 else 's'}"
            rules.append(f"observers who missed more than {trials} left out")
        if self.screening is not None:
            tests = f" ({', '.join(self.screening)})" if self.screening else ""
            others = "kept" if self.unscreened == "keep" else "left out"
            rules.append(f"observers who failed the vision screening{tests} left out, unscreened ones {others}")
        text = "; ".join(rules) or "no observer left out"
        return f"{text[0].upper()}{text[1:]}."
