"""What the eyes saw: stereo mode, filters and their cost, clipping, size on the screen, surround, resampling, display.

It follows from the logs' headers and trials, and is stated here alone: the report's notes, Methods, captions and
tables, the table of trials and the BIDS export all read it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields, replace
from statistics import fmean
from typing import Any

from analysis.records.lines import EyeCosts, Eyes, FilterTransmittances, SeenDisplay, Stimulus
from analysis.records.session_record import SessionLog

Both = tuple[float, float]
_ANAGLYPH = "anaglyph-"
# What an eye gets of its picture's pixels in the modes that do not give it all of them.
SAMPLED = {
    "side-by-side-half": "the mean of every two columns",
    "top-bottom-half": "the mean of every two rows",
    "row-interleaved": "every second row",
    "column-interleaved": "every second column",
    "checkerboard": "every second pixel, as the squares of a checkerboard",
}
# Of what the record of a session rests on, that which decides on what the eyes see.
_DECIDES = "experiment", "stimuli", "display", "rig"


@dataclass(frozen=True, slots=True)
class EyeCost:
    """What a stimulus lost in one ``eye``, or in ``both`` alike; None where it was not recorded.

    ``percent_any`` and ``percent_above_full`` are the pixels out of the gamut, in percent, ``delta_e_00_mean`` and
    ``delta_e_00_max`` what clipping them cost, and ``filters_mean`` and ``filters_max`` the ΔE00 that an anaglyph's
    filters cost besides.
    """

    stimulus: str
    eye: str
    percent_any: float | None = None
    percent_above_full: float | None = None
    delta_e_00_mean: float | None = None
    delta_e_00_max: float | None = None
    filters_mean: float | None = None
    filters_max: float | None = None

    @classmethod
    def of(cls, stimulus: str, eye: str, recorded: EyeCosts) -> EyeCost:
        """Return what is ``recorded`` of an eye."""
        return cls(
            stimulus,
            eye,
            recorded.percent_any,
            recorded.percent_above_full,
            recorded.delta_e_00_mean,
            recorded.delta_e_00_max,
            recorded.projection_delta_e_00_mean,
            recorded.projection_delta_e_00_max,
        )

    def is_as(self, other: EyeCost) -> bool:
        """Return whether the numbers of another eye are the same."""
        return all(getattr(self, one.name) == getattr(other, one.name) for one in fields(self)[2:])


def eye_costs(stimuli: Iterable[Stimulus], names: Sequence[str] | None = None) -> list[EyeCost]:
    """Return one for each of the header's ``stimuli`` and eye, in the order of ``names``; one for both if equal."""
    known = {stimulus.name: stimulus.clipping.eyes if stimulus.clipping else [] for stimulus in stimuli}
    costs = []
    for name in known if names is None else names:
        both = [EyeCost.of(name, eye, recorded) for eye, recorded in known.get(name, [])]
        if len(both) == 2 and both[0].is_as(both[1]):
            both = [replace(both[0], eye="both")]
        costs += both
    return costs


def ghosts_recorded(stimuli: Iterable[Stimulus]) -> Iterator[tuple[str, str, EyeCosts]]:
    """Yield stimulus, eye and record of the crosstalk that could not be cancelled."""
    for stimulus in stimuli:
        if stimulus.clipping and stimulus.clipping.crosstalk:
            yield from ((stimulus.name, eye, cost) for eye, cost in stimulus.clipping.crosstalk.eyes)


@dataclass(frozen=True, slots=True)
class Cost:
    """ΔE00 of pictures: its ``mean`` over stimuli and eyes, the worst mean of one, and the largest of a pixel.

    ``stimulus`` has the worst mean.
    """

    mean: float
    worst_mean: float
    largest: float
    stimulus: str

    @classmethod
    def over(cls, costs: Iterable[tuple[str, float | None, float | None]]) -> Cost | None:
        """Return that of stimuli with mean and largest ΔE00 each; None where it was recorded of none."""
        known = [(mean, mean if most is None else most, name) for name, mean, most in costs if mean is not None]
        if not known:
            return None
        worst = max(known, key=lambda one: one[0])
        return cls(fmean(mean for mean, _, _ in known), worst[0], max(most for _, most, _ in known), worst[2])

    def to_json(self, what: str) -> dict[str, Any]:
        """Return plain values under keys that begin with ``what``."""
        values = {"mean": self.mean, "worst_mean": self.worst_mean, "max": self.largest}
        numbers = {f"{what}_delta_e_00_{key}": round(value, 5) for key, value in values.items()}
        return {**numbers, f"{what}_worst_stimulus": self.stimulus}


@dataclass(frozen=True, slots=True)
class Size:
    """The size of a picture on the screen in pixels and, where the screen's distance is known, in degrees."""

    width_px: int
    height_px: int
    width_deg: float | None = None
    height_deg: float | None = None


@dataclass(frozen=True, slots=True)
class Seen:
    """What the eyes saw in sessions; empty or None where the logs do not say it.

    Attributes
    ----------
    mode
        The stereo mode.
    characterised_as
        The mode in which the display was measured; empty where it was not.
    glasses
        The glasses that the rig names.
    nominal
        What a display that was not measured was taken for, in words; empty where it was measured.
    has_filters
        Whether one picture was made for both eyes and seen through coloured filters, as an anaglyph is.
    filters_are
        Where these filters are known from, of the left and the right eye: ``measured`` with the display, ``stated`` in
        the rig, or ``assumed``, round figures.
    filters
        What the filters cost, beside what clipping did.
    clipping
        What clipping to the display's gamut cost.
    ghosts
        What crosstalk cost that could not be cancelled.
    white_cd_m2
        Luminance of white at the left and the right eye, behind the filters.
    surround_cd_m2
        Luminance around the pictures at the left and the right eye, likewise.
    dimmed_to
        The share of their luminance that pictures kept so that the panel is even; None where they kept it all.
    lifted_by
        The share of white by which black was lifted so that crosstalk could be cancelled; None where it was not.
    smallest, largest
        Size of the smallest and the largest picture on the screen.
    resampled
        How recipes resampled pictures, such as ``area``, and ``none`` for pictures that are shown pixel for pixel.
    partly_unseen
        Whether the panel was larger than the screen in some trials, so that a part was not seen.
    changed
        What was changed, and accepted, when a session was resumed: the rest holds until then.
    """

    mode: str = ""
    characterised_as: str = ""
    glasses: str = ""
    nominal: str = ""
    has_filters: bool = False
    filters_are: tuple[str, str] | None = None
    filters: Cost | None = None
    clipping: Cost | None = None
    ghosts: Cost | None = None
    white_cd_m2: Both | None = None
    surround_cd_m2: Both | None = None
    dimmed_to: float | None = None
    lifted_by: float | None = None
    smallest: Size | None = None
    largest: Size | None = None
    resampled: tuple[str, ...] = ()
    partly_unseen: bool = False
    changed: tuple[str, ...] = ()

    @classmethod
    def of(cls, *sessions: SessionLog) -> Seen:
        """Return what the eyes saw in ``sessions`` of one experiment on one display: costs of all that any records."""
        header = sessions[0].header
        display, stimuli = header.display, _stimuli(sessions)
        mode, nominal = display.mode or "", display.nominal
        costs = eye_costs(stimuli)
        filters = Cost.over((cost.stimulus, cost.filters_mean, cost.filters_max) for cost in costs)
        has_filters = filters is not None or mode.startswith(_ANAGLYPH)
        white = display.white_XYZ_cd_m2
        if has_filters:
            white = display.filters.white_XYZ_cd_m2 if display.filters else None
        sizes = sorted(_sizes(stimuli, display), key=lambda size: size.width_px * size.height_px)
        return cls(
            mode,
            "" if nominal else display.characterised_as or "",
            display.glasses or "",
            nominal.said if nominal else "",
            has_filters,
            _filters_are(display.filters) if has_filters and display.filters else None,
            filters,
            Cost.over((cost.stimulus, cost.delta_e_00_mean, cost.delta_e_00_max) for cost in costs),
            Cost.over((name, cost.delta_e_00_mean, cost.delta_e_00_max) for name, _, cost in ghosts_recorded(stimuli)),
            _luminances(white),
            _luminances(display.surround_XYZ_cd_m2),
            share if (share := display.gain_map_delivers) and share < 1.0 else None,
            max((_lift(one) for one in stimuli), default=0.0) or None,
            sizes[0] if sizes else None,
            sizes[-1] if sizes else None,
            tuple(dict.fromkeys(one.resampled or "none" for one in stimuli if "resampled" in one.model_fields_set)),
            any(trial.wrong_screen for session in sessions for trial in session.trials),
            _changed(sessions),
        )

    @property
    def sampled(self) -> str:
        """What an eye got of its picture's pixels, where that is not all of them; else empty."""
        return SAMPLED.get(self.mode, "")

    @property
    def otherwise(self) -> str:
        """What an eye gets in place of its own view; empty where it gets its view."""
        if self.has_filters:
            return "both views mixed, through its coloured filter"
        return f"{self.sampled} of its view" if self.sampled else ""

    def to_json(self) -> dict[str, Any]:
        """Return what is known as plain values, one under each key."""
        values: dict[str, Any] = {"mode": self.mode, "characterised_as": self.characterised_as}
        values |= {"glasses": self.glasses, "nominal": self.nominal, "sampled": self.sampled}
        for eye, known in zip(("left", "right"), self.filters_are or (), strict=False):
            values[f"{eye}_filter"] = known
        for what, cost in (("filters", self.filters), ("clipping", self.clipping), ("ghosts", self.ghosts)):
            values |= cost.to_json(what) if cost else {}
        for what, both in (("white", self.white_cd_m2), ("surround", self.surround_cd_m2)):
            values |= {f"{what}_{eye}_cd_m2": one for eye, one in zip(("left", "right"), both or (), strict=False)}
        values |= {"dimmed_to_share": self.dimmed_to, "lifted_by_share": self.lifted_by}
        for which, size in (("smallest", self.smallest), ("largest", self.largest)):
            values |= {f"{which}_{key}": value for key, value in asdict(size).items()} if size else {}
        values |= {"resampled": ", ".join(self.resampled), "changed": ", ".join(self.changed)}
        values |= {"partly_unseen": True} if self.partly_unseen else {}
        return {key: value for key, value in values.items() if value not in (None, "")}


def what_eyes_saw(sessions: Iterable[SessionLog]) -> dict[Seen, int]:
    """Return what the eyes saw in ``sessions``, each only once, with the number of sessions in which they saw it so."""
    alike: dict[tuple[object, ...], list[SessionLog]] = {}
    for session in sessions:
        header = session.header
        key = (header.display.mode, *(header.hashes.get(name) for name in _DECIDES), _changed([session]))
        alike.setdefault(key, []).append(session)
    counts: dict[Seen, int] = {}
    for group in alike.values():
        seen = Seen.of(*group)
        counts[seen] = counts.get(seen, 0) + len(group)
    return counts


def _stimuli(sessions: Sequence[SessionLog]) -> list[Stimulus]:
    """Return the stimuli with the costs that any of the sessions records: one that ended early has not all of them."""
    known: dict[str, Stimulus] = {}
    for session in sessions:
        for stimulus in session.header.stimuli:
            if stimulus.name not in known or not known[stimulus.name].clipping:
                known[stimulus.name] = stimulus
    return list(known.values())


def _filters_are(stated: FilterTransmittances) -> tuple[str, str]:
    def known(eye: str, light: object) -> str:
        return "assumed" if eye in stated.assumed else "measured" if light is None else "stated"

    return known("left", stated.left), known("right", stated.right)


def _luminances(eyes: Eyes | None) -> Both | None:
    return (eyes.left[1], eyes.right[1]) if eyes and eyes.left and eyes.right else None


def _lift(stimulus: Stimulus) -> float:
    crosstalk = stimulus.clipping and stimulus.clipping.crosstalk
    return (crosstalk and crosstalk.lift_share) or 0.0


def _sizes(stimuli: Iterable[Stimulus], display: SeenDisplay) -> Iterator[Size]:
    from devices.display import visual_angle_deg

    pitch_mm, distance_mm = display.panel.pixel_pitch_mm, display.distance_mm
    for stimulus in stimuli:
        if not (size := stimulus.size_px):
            continue
        if not (pitch_mm and distance_mm):
            yield Size(*size)
            continue
        angles = (round(float(visual_angle_deg(side * pitch_mm, distance_mm)), 2) for side in size)
        yield Size(*size, *angles)


def _changed(sessions: Iterable[SessionLog]) -> tuple[str, ...]:
    accepted: Collection[str] = {name for log in sessions for stop in log.resumptions for name in stop.accepted_changes}
    return tuple(name for name in _DECIDES if name in accepted)
