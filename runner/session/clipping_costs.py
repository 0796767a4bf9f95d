"""What the gamut clip costs each picture of an experiment, for its trials' records: computed once, then cached.

A cost depends on the picture's content, on what the aperture lets through, on the display's numbers and the stereo
mode, and on nothing else: how codes are rounded or dithered is not part of it. Where all of these are as before, it is
read from the cache beside the stimuli.
"""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from devices.compensation import Compensation, Correction, Mixture, eye_clip_costs
from documents.files import read_cached_json, sha256_of_json, write_whole
from runner.protocol.experiment import Experiment
from runner.session.header import hashes
from stimuli.build import StimulusSet, cache_folder
from stimuli.pictures import StereoImage

# Raise it when the same picture on the same display costs other numbers than before.
COST_VERSION = 4
COSTS = "costs"


@dataclass(slots=True)
class CostWork:
    """How many costs and lifts of pictures were computed, and how many were read from the cache."""

    clipping_costs_computed: int = 0
    clipping_costs_cached: int = 0


@dataclass(frozen=True, eq=False, slots=True)
class ClippingCosts:
    """The clipping costs of an experiment's stimuli.

    ``load`` is asked for a picture, as it is shown, only where its cost must be computed.
    """

    stimuli: StimulusSet
    load: Callable[[str], StereoImage]
    compensation: Compensation
    places_px: tuple[tuple[int, int], ...]
    aperture_px: tuple[int, int]
    depends_on: Mapping[str, Any]
    cache: CostCache
    work: CostWork = field(default_factory=CostWork)

    @classmethod
    def of(
        cls,
        experiment: Experiment,
        stimuli: StimulusSet,
        load: Callable[[str], StereoImage],
        cache: CostCache | None = None,
    ) -> ClippingCosts:
        """Return the costs of ``experiment``, with the lift that its most demanding picture needs, if one is wanted.

        ``load`` gives pictures as they are shown. Without ``cache`` it is the one beside the stimulus sets.
        """
        rig = experiment.rig
        panel_px = rig.display.panel.resolution_px
        compensation = experiment.mode.compensation(rig.models, panel_px, Correction(rig.crosstalk, rig.gain_map))
        cache = cache or CostCache(cache_folder() / COSTS)
        depends_on = _depends_on(experiment, stimuli, compensation)
        costs = cls(stimuli, load, compensation, experiment.places_px, experiment.aperture_px, depends_on, cache)
        if rig.crosstalk is None or not rig.spec.lift_black:
            return costs
        lift_share = max((costs._lift(name) for name in stimuli.names), default=0.0)
        return replace(costs, compensation=compensation.lifted(lift_share))

    def description(self, name: str, image: StereoImage | None = None) -> dict[str, Any]:
        """Return the name, the factors and the costs of the stimulus ``name``, as a session's header has them.

        Where they must be computed and the picture was read already, it is ``image``.
        """

        def compute() -> dict[str, Any]:
            shown = self.load(name) if image is None else image
            return {"flat": shown.is_flat, "clipping": clipping_record(shown, self.compensation, self.places_px)}

        return {**self._named(name), **self._cost("clip", name, self._more, compute)}

    def outline(self, name: str) -> dict[str, Any]:
        """Return the `description` of the stimulus ``name`` if the cache has its costs, else all of it but these.

        No picture is read for it.
        """
        cost = self._found(self._rests_on("clip", name, self._more))
        return {**self._named(name), **(cost or {"flat": bool(self.stimuli.entry(name)["flat"])})}

    def _named(self, name: str) -> dict[str, Any]:
        """Return what is known without the picture: name, factors, size as it is shown, and how it was resampled."""
        size_px = [min(both) for both in zip(self.stimuli.size_px(name), self.aperture_px, strict=True)]
        steps = self.stimuli.entry(name).get("steps", ())
        resampled = ", ".join(words for step in steps if (words := _resampling(step)))
        more = {"size_px": size_px, "resampled": resampled or None}
        return {"name": name, "factors": dict(self.stimuli.factors(name)), **more}

    @property
    def _more(self) -> dict[str, Any]:
        correction = self.compensation.correction
        return {
            "lift_share": correction.lift_share,
            "places_px": self.places_px if correction.depends_on_place else (),
        }

    def _lift(self, name: str) -> float:
        def compute() -> dict[str, Any]:
            image = self.load(name)
            return {"share": self.compensation.needed_lift((image.left, image.right))}

        return float(self._cost("lift", name, {}, compute)["share"])

    def _cost(
        self, what: str, name: str, more: Mapping[str, Any], compute: Callable[[], dict[str, Any]]
    ) -> dict[str, Any]:
        depends_on = self._rests_on(what, name, more)
        cost = self._found(depends_on)
        if cost is not None:
            return cost
        cost = compute()
        self.work.clipping_costs_computed += 1
        self.cache.keep(depends_on, cost)
        return cost

    def _rests_on(self, what: str, name: str, more: Mapping[str, Any]) -> dict[str, Any]:
        """Return all that a cost of the stimulus ``name`` depends on."""
        picture = str(self.stimuli.entry(name)["sha256"])
        return {"version": COST_VERSION, "what": what, "picture": picture, **self.depends_on, **more}

    def _found(self, depends_on: Mapping[str, Any]) -> dict[str, Any] | None:
        cost = self.cache.find(depends_on)
        self.work.clipping_costs_cached += cost is not None
        return cost


# The steps of a recipe that compute pixels between pixels, and what says how, or whether they did.
_RESAMPLING = {
    "resample": "filter",
    "interpolate": "interpolation",
    "straighten": "applied",
    "rectify_toe_in": "interpolation",
}


def _resampling(step: Mapping[str, Any]) -> str:
    """Return how a step of a recipe resampled its picture, such as "resample (area)"; empty if it did not."""
    kind = str(step.get("step"))
    how = step.get(_RESAMPLING[kind], True) if kind in _RESAMPLING else None
    return f"{kind} ({how})" if isinstance(how, str) else kind if how else ""


def clipping_record(
    image: StereoImage, compensation: Compensation, places_px: Sequence[tuple[int, int]]
) -> dict[str, Any]:
    """Return what the gamut clip and uncancelled crosstalk cost each eye of ``image``.

    Where a gain map makes the clip depend on the place, each number is the worst of ``places_px``. Where a mode mixes
    both views into one picture, that picture is what is clipped, and each eye's costs are those seen through its filter
    (see `devices.compensation.eye_costs`).
    """
    picture = image.left, image.right
    costs: dict[str, dict[str, float]] = {"left": {}, "right": {}}
    places_px = places_px or ((0, 0),)  # of a session that shows none
    for place in places_px if compensation.correction.depends_on_place else places_px[:1]:
        asked = compensation.evened(picture, place)
        of_eyes = eye_clip_costs(compensation.models, compensation.mixture, *asked, half=image.half)
        for eye, cost in of_eyes.items():
            costs[eye] = {key: max(value, costs[eye].get(key, value)) for key, value in cost.items()}
    crosstalk = compensation.uncancelled(picture, half=image.half)
    return {**costs, "crosstalk": crosstalk} if crosstalk else {**costs}


def _depends_on(experiment: Experiment, stimuli: StimulusSet, compensation: Compensation) -> dict[str, Any]:
    """Return what costs depend on beside the picture, alike for all pictures."""
    rig = experiment.rig
    view = compensation.views["left"]
    mixture = compensation.mixture
    return {
        "display": hashes(experiment, stimuli)["display"],
        "resolution_px": list(rig.display.panel.resolution_px),
        "mode": rig.mode,
        "mode_options": dict(rig.spec.mode_options),
        "mixture": None if mixture is None else _digest(mixture),
        "aperture_px": list(experiment.aperture_px),
        "view_px": list(view.view_px),
        "squeeze": list(view.squeeze),
    }


def _digest(mixture: Mixture) -> str:
    """Return the SHA-256 of a mixture's matrices; its blacks and curves are the display's."""
    matrices = mixture.left, mixture.right, mixture.left_through, mixture.right_through
    return sha256_of_json([np.asarray(matrix).tolist() for matrix in matrices])


_PART = ".part"
# A file is written in a moment: one that is not finished after so long is of a program that was killed.
_LEFT_BEHIND_S = 3600.0


class CostCache:
    """Numbers in files below ``folder``, one for each set of things that they depend on.

    Each file holds what its numbers depend on, the numbers, and their SHA-256, and appears as a whole. A file that was
    cut short, damaged, or made by another version counts as missing: its numbers are computed again. What cannot be
    written is not kept. Any number of programs may use one folder at once.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._tidied = False

    def find(self, depends_on: Mapping[str, Any]) -> dict[str, Any] | None:
        """Return what was kept for ``depends_on``, None if nothing was or it is not as it was kept."""
        try:
            kept = read_cached_json(self._file(depends_on))
            if kept["depends_on"] != _plain(depends_on) or kept["sha256"] != sha256_of_json(kept["cost"]):
                return None
            cost = kept["cost"]
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return None
        return cost if isinstance(cost, dict) else None

    def keep(self, depends_on: Mapping[str, Any], cost: Mapping[str, Any]) -> bool:
        """Keep ``cost`` for ``depends_on``, both of what JSON holds; return whether that could be done."""
        kept = {"depends_on": depends_on, "cost": cost, "sha256": sha256_of_json(cost)}
        text = json.dumps(kept, indent=1, allow_nan=False) + "\n"
        file = self._file(depends_on)
        try:
            self._tidy()
            write_whole(file, text)
        except OSError:
            return False
        return True

    def _file(self, depends_on: Mapping[str, Any]) -> Path:
        return self._folder / f"{sha256_of_json(depends_on)[:32]}.json"

    def _tidy(self) -> None:
        """Remove what killed programs left behind; once is enough."""
        if self._tidied:
            return
        self._tidied = True
        for part in self._folder.glob(f".*{_PART}"):
            with contextlib.suppress(OSError):
                if time.time() - part.stat().st_mtime > _LEFT_BEHIND_S:
                    part.unlink()


def _plain(value: Mapping[str, Any]) -> Any:
    """Return ``value`` as it comes back from a file: with lists for tuples."""
    return json.loads(json.dumps(value))
