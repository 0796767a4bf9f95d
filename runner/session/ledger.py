"""What showing each picture of an experiment costs it, for its trials' records: reckoned once, and found from then on.

A cost depends on the picture's content, on what the aperture lets through, on the display's numbers and the stereo
mode, and on nothing else: how codes are rounded or dithered is not part of it. Where all of these are as before, it is
found in the cache beside the stimuli.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from documents.files.hashes import sha256_of_json
from runner.presenter.compensation import Compensation
from runner.presenter.modes.mixture import Mixture
from runner.protocol.experiment import Experiment
from runner.session.cost_cache import CostCache
from runner.session.header import describe_stimulus, hashes
from stimuli.build.cache import cache_folder
from stimuli.build.stimulus_set import StimulusSet
from stimuli.pictures.stereo_image import StereoImage

# Raise it when the same picture on the same display costs other numbers than before.
COST_VERSION = 1
COSTS = "costs"


@dataclass(slots=True)
class LedgerWork:
    """How many pictures' costs, and lifts, were reckoned, and how many found that were reckoned before."""

    costs_reckoned: int = 0
    costs_found: int = 0


@dataclass(frozen=True, eq=False, slots=True)
class Ledger:
    """What the stimuli of an experiment cost; ``load`` is asked for a picture only where its cost must be reckoned."""

    stimuli: StimulusSet
    load: Callable[[str], StereoImage]
    compensation: Compensation
    places_px: tuple[tuple[int, int], ...]
    surroundings: Mapping[str, Any]
    cache: CostCache
    work: LedgerWork = field(default_factory=LedgerWork)

    @classmethod
    def of(
        cls,
        experiment: Experiment,
        stimuli: StimulusSet,
        load: Callable[[str], StereoImage],
        cache: CostCache | None = None,
    ) -> Ledger:
        """Return the ledger of ``experiment``, with the lift that its most demanding picture needs, if one is wanted.

        ``load`` gives pictures as they are shown. Without ``cache`` it is the one beside the stimulus sets.
        """
        rig = experiment.rig
        plain = Compensation.unlifted(rig, experiment.mode)
        cache = cache or CostCache(cache_folder() / COSTS)
        surroundings = _surroundings(experiment, stimuli, plain)
        ledger = cls(stimuli, load, plain, experiment.places_px, surroundings, cache)
        if rig.crosstalk is None or not rig.lift_black:
            return ledger
        lift_share = max((ledger._lift(name) for name in stimuli.names), default=0.0)
        return replace(ledger, compensation=replace(plain, lift_share=lift_share))

    def description(self, name: str) -> dict[str, Any]:
        """Return what `describe_stimulus` does of the stimulus ``name``."""
        more = {
            "lift_share": self.compensation.lift_share,
            "places_px": self.places_px if self.compensation.depends_on_place else (),
        }

        def reckon() -> dict[str, Any]:
            told = describe_stimulus(name, self.load(name), {}, self.compensation, self.places_px)
            return {"flat": told["flat"], "clipping": told["clipping"]}

        return {"name": name, "factors": dict(self.stimuli.factors(name)), **self._cost("clip", name, more, reckon)}

    def _lift(self, name: str) -> float:
        needed = self._cost("lift", name, {}, lambda: {"share": self.compensation.needed_lift(self.load(name))})
        return float(needed["share"])

    def _cost(
        self, what: str, name: str, more: Mapping[str, Any], reckon: Callable[[], dict[str, Any]]
    ) -> dict[str, Any]:
        picture = str(self.stimuli.entry(name)["sha256"])
        depends_on = {"version": COST_VERSION, "what": what, "picture": picture, **self.surroundings, **more}
        cost = self.cache.find(depends_on)
        if cost is not None:
            self.work.costs_found += 1
            return cost
        cost = reckon()
        self.work.costs_reckoned += 1
        self.cache.keep(depends_on, cost)
        return cost


def _surroundings(experiment: Experiment, stimuli: StimulusSet, compensation: Compensation) -> dict[str, Any]:
    """Return what costs depend on beside the picture, alike for all pictures."""
    rig = experiment.rig
    area = experiment.mode.areas(rig.display.panel.resolution_px)[0]
    mixture = experiment.mode.mixture(rig.models)
    return {
        "display": hashes(experiment, stimuli)["display"],
        "resolution_px": list(compensation.resolution_px),
        "mode": rig.mode,
        "mode_options": dict(rig.mode_options),
        "mixture": None if mixture is None else _digest(mixture),
        "aperture_px": list(experiment.aperture_px),
        "view_px": list(area.view_px),
        "squeeze": list(area.squeeze),
    }


def _digest(mixture: Mixture) -> str:
    """Return the SHA-256 of a mixture's matrices; its blacks and curves are the display's."""
    matrices = mixture.left, mixture.right, mixture.left_through, mixture.right_through
    return sha256_of_json([np.asarray(matrix).tolist() for matrix in matrices])
