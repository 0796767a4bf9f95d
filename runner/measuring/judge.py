"""Whether readings make sense while they are taken: aim, lens, order of channels, drift, saturation, stuck readings.

Each limit is wider than what an honest display does, so that one through dark glasses, without any black light, with a
strong leak between the eyes or behind a coloured filter is never doubted; what is doubted cannot be fitted either.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from devices.display import wrong_lens
from devices.readings import KeptReading, Patch, PatchTurn, Reading, must_differ
from documents.arrays import Floats

MOST_LIGHT_CD_M2 = 100_000.0
"""Ten times the brightest that a signal can ask for, 10 000 cd/m² (SMPTE ST 2084)."""
LEAST_WHITE_CD_M2 = 0.01
"""Three times the least that a CS-2000 reads [KonicaMinoltaCS2000]: a darker white has no tones beside black."""
LEAST_CONTRAST = 1.5
"""White to black. A projector in a lit room has 2 and more; an instrument that does not see the patch has 1."""
MOST_CHANGE = 0.2
"""Of white, from one repeat to the next. A display that warms up changes by 10 % in two minutes, and
benchmarks/display_fits.py takes off 13 % in a measurement; a nap, a dimmed backlight or a moved lens change more."""
MOST_NEGATIVE = 0.01
"""Of white, as `display fit` has it: noise around no light. Never less than `NOISE_CD_M2`."""
NOISE_CD_M2 = 0.03
"""Ten times the least that a CS-2000 reads [KonicaMinoltaCS2000]."""
LEAST_SHARE = 0.05
"""Of the brightest channel's light: a channel with less, as behind a filter, is not judged by its colour."""
CLEARLY = 1.5
"""By so much must two of X, Y and Z contradict the names of two channels; exchanged ones do by 3 and more."""
_DARK = 0.02  # of the brightest: readings of dark patches may well be equal
_LIT = 0.5  # from this code on, a channel alone shows its colour
_STUCK = 3
_NAMES = ("red", "green", "blue")
_NAMED = 6


@dataclass(frozen=True, slots=True)
class Doubt:
    """What is wrong with the readings of ``steps``, and what to do, in ``words``; ``kind`` is the check's name."""

    kind: str
    words: str
    steps: tuple[PatchTurn, ...]

    @property
    def positions(self) -> tuple[int, ...]:
        """Where the steps stand in the order."""
        return tuple(step.position for step in self.steps)

    @property
    def labels(self) -> tuple[str, ...]:
        """The steps' labels."""
        return tuple(step.label for step in self.steps)


@dataclass(frozen=True, slots=True, eq=False)
class _Read:
    step: PatchTurn
    XYZ: Floats

    @property
    def situation(self) -> Patch:
        """All but the name and the codes of the patch: readings of one situation can be compared."""
        return replace(self.step.patch, name="-", codes=(0.0, 0.0, 0.0), wait_s=0.0)


class Judge:
    """Judges readings one after the other.

    ``before`` are those of ``steps`` that a resumed measurement holds already; they are trusted. A check that was
    doubted once is not doubted again.
    """

    def __init__(self, before: Sequence[KeptReading] = (), steps: Sequence[PatchTurn] = ()) -> None:
        kept = sorted(before, key=lambda one: (one.time_s, one.position))
        self._read = [_Read(steps[one.position], np.array(one.reading.XYZ_cd_m2)) for one in kept]
        self._new = self._checked = len(self._read)
        self._doubted: set[str] = set()

    def doubt(self, step: PatchTurn, reading: Reading) -> Doubt | None:
        """Return what is wrong with ``reading`` of ``step``, or with those before it, None if nothing is."""
        newest = _Read(step, np.array(reading.XYZ_cd_m2))
        self._read.append(newest)
        situation = newest.situation
        alike = [one for one in self._read if one.situation == situation]
        found = [_too_bright(newest)]
        if "@" not in step.patch.name:
            found += [check(alike) for check in _CHECKS]
        elif step.patch.eye is not None:
            found.append(_lens([one for one in self._read if one.step.patch.eye == step.patch.eye]))
        doubts = [one for one in found if one is not None and one.kind not in self._doubted]
        if not doubts:
            self._pass(alike)
            return None
        self._doubted.add(doubts[0].kind)
        return self._with_others(doubts[0])

    def _pass(self, alike: list[_Read]) -> None:
        """Trust all readings so far where white has just been read and makes sense, beside black and the white before.

        Black alone, which comes before it, shows neither a drift nor a cap.
        """
        if _codes(alike[-1]) == {1.0} and _last(alike, 0.0) is not None:
            self._checked = len(self._read)

    def _with_others(self, doubt: Doubt) -> Doubt:
        """Return ``doubt`` of all readings that it holds for: where it names none, of those not trusted yet."""
        since = {"order": self._new}.get(doubt.kind, self._checked)
        return doubt if doubt.steps else replace(doubt, steps=_steps(self._read[since:]))


def _codes(one: _Read) -> set[float]:
    return set(one.step.patch.codes)


def _last(alike: Sequence[_Read], code: float) -> _Read | None:
    """Return the last reading of the grey with ``code``, None if there is none."""
    return next((one for one in reversed(alike) if _codes(one) == {code}), None)


def _steps(read: Sequence[_Read]) -> tuple[PatchTurn, ...]:
    return tuple(one.step for one in read)


def _words(XYZ: Floats) -> str:
    return "X {:.4g}, Y {:.4g}, Z {:.4g}".format(*XYZ)


def _too_bright(newest: _Read) -> Doubt | None:
    if newest.XYZ.max() <= MOST_LIGHT_CD_M2:
        return None
    what = f"{newest.step.label} reads {_words(newest.XYZ)} cd/m², brighter than any display"
    return Doubt("light", f"{what}: check the instrument's unit, range and connection", _steps([newest]))


def _negative(alike: Sequence[_Read]) -> Doubt | None:
    white = _last(alike, 1.0)
    if white is None:
        return None
    least = -max(MOST_NEGATIVE * float(white.XYZ[1]), NOISE_CD_M2)
    below = [one for one in (alike if white is alike[-1] else alike[-1:]) if one.XYZ.min() < least]
    if not below:
        return None
    what = f"{below[0].step.label} reads {_words(below[0].XYZ)} cd/m², and no light is below zero"
    return Doubt("negative", f"{what}: calibrate the instrument's dark level, with its cap on", ())


def _aim(alike: Sequence[_Read]) -> Doubt | None:
    white, black = _last(alike, 1.0), _last(alike, 0.0)
    if white is None or alike[-1] not in (white, black):
        return None
    bright, dark = float(white.XYZ[1]), 0.0 if black is None else float(black.XYZ[1])
    if bright >= max(LEAST_WHITE_CD_M2, LEAST_CONTRAST * dark):
        return None
    beside = "" if black is None else f" and black {dark:.3g}"
    what = f"white reads {bright:.3g} cd/m²{beside}: the instrument does not see the patch change"
    remedy = "point it at the middle of the patch, take its cap off, put the right lens before it, darken the room"
    return Doubt("aim", f"{what}; {remedy}, and see that the display is on", ())


def _drift(alike: Sequence[_Read]) -> Doubt | None:
    whites = [one for one in alike if _codes(one) == {1.0} and not one.step.patch.wait_s]
    if len(whites) < 2 or alike[-1] is not whites[-1]:
        return None
    before, now = (float(one.XYZ[1]) for one in whites[-2:])
    if abs(now - before) <= MOST_CHANGE * before + NOISE_CD_M2:
        return None
    what = f"white read {before:.4g} cd/m² at {whites[-2].step.label} and reads {now:.4g} at {whites[-1].step.label}"
    remedy = (
        "see that neither the instrument nor the glasses moved, let the display warm up, and switch off what dims it"
    )
    return Doubt("drift", f"{what}: {remedy}; then resume if white is as it was, or begin again", ())


def _order(alike: Sequence[_Read]) -> Doubt | None:
    """Find two channels whose colours contradict their names: red has more X for its Y than green, and so on."""
    black = _last(alike, 0.0)
    if sum(code > 0 for code in alike[-1].step.patch.codes) != 1:
        return None
    light = {i: one.XYZ - (0.0 if black is None else black.XYZ) for i, one in _alone(alike).items()}
    brightest = max((float(np.linalg.norm(own)) for own in light.values()), default=0.0)
    bright = {i: np.maximum(own, 0.0) for i, own in light.items() if np.linalg.norm(own) >= LEAST_SHARE * brightest}
    none = 0.01 * brightest  # noise of what a filter takes away
    for first, second in ((0, 1), (0, 2), (1, 2)):
        if first in bright and second in bright:
            one, other = bright[first] + none, bright[second] + none
            if CLEARLY * one[first] * other[second] < other[first] * one[second]:
                read = "; ".join(f"{_NAMES[i]}: {_words(light[i])}" for i in (first, second))
                what = f"{_NAMES[first]} and {_NAMES[second]} do not read as the colours that they are called ({read})"
                remedy = (
                    "look at the screen: colour effects, an inverted picture or X, Y and Z in another order do this"
                )
                return Doubt("order", f"{what}; {remedy}", ())
    return None


def _alone(alike: Sequence[_Read]) -> dict[int, _Read]:
    """Return the reading of each channel alone that is driven most, by channel."""
    found: dict[int, _Read] = {}
    for one in alike:
        lit = [i for i, code in enumerate(one.step.patch.codes) if code > 0]
        if len(lit) == 1 and one.step.patch.codes[lit[0]] >= _LIT:
            i = lit[0]
            if i not in found or one.step.patch.codes[i] >= found[i].step.patch.codes[i]:
                found[i] = one
    return found


def _saturated(alike: Sequence[_Read]) -> Doubt | None:
    white = _last(alike, 1.0)
    if white is None:
        return None
    for axis in range(3):
        top = alike[-1].XYZ[axis]
        if top < max(one.XYZ[axis] for one in alike) or top < white.XYZ[axis]:
            continue
        equal = [one for one in alike if one.XYZ[axis] == top]
        if must_differ(np.array([one.step.patch.codes for one in equal])):
            what = f"{'XYZ'[axis]} is exactly {top:g} at {_labels(equal)}: the instrument is saturated"
            return Doubt("saturation", f"{what}; set a shorter exposure, or put a filter before it", _steps(equal))
    return None


def _stuck(alike: Sequence[_Read]) -> Doubt | None:
    last = alike[-_STUCK:]
    least = max(LEAST_WHITE_CD_M2, _DARK * max(float(one.XYZ[1]) for one in alike))
    equal = all(np.array_equal(one.XYZ, last[0].XYZ) for one in last)
    if not equal or last[0].XYZ[1] < least or not must_differ(np.array([one.step.patch.codes for one in last])):
        return None
    what = f"{_labels(last)} all read exactly {_words(last[0].XYZ)}"
    return Doubt("stuck", f"{what}: the instrument repeats its reading; switch it off and on, and resume", _steps(last))


def _lens(through: Sequence[_Read]) -> Doubt | None:
    """Find a lens that passes the other eye's white as its own: the wrong one, or none."""
    read = {(one.step.patch.codes, one.step.patch.other): one for one in through if "@other" in one.step.patch.name}
    black, white = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
    own, leak = read.get((white, black)), read.get((black, white))
    if own is None or leak is None:
        return None
    dark = float(read[black, black].XYZ[1]) if (black, black) in read else 0.0
    eye = str(own.step.patch.eye)
    words = wrong_lens(eye, float(own.XYZ[1]) - dark, float(leak.XYZ[1]) - dark)
    return Doubt(f"lens {eye}", words, _steps(through)) if words else None


def _labels(read: Sequence[_Read]) -> str:
    named = ", ".join(one.step.label for one in read[:_NAMED])
    return named + (f" and {len(read) - _NAMED} more" if len(read) > _NAMED else "")


_CHECKS: tuple[Callable[[Sequence[_Read]], Doubt | None], ...] = (
    _aim,
    _negative,
    _drift,
    _stuck,
    _saturated,
    _order,
)
