"""The figure of the factors' effects, as SVG for a page, and its rows, which are those of the table beside it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from analysis.errors import ResultsError
from documents import Finding
from documents.figures import FAINT, INK, Drawing, drawing, drawn, short
from extensions.factors.result import Effect, FactorEffects
from extensions.factors.values import Factor

EFFECT, LONGEST_NAME = "#165466", 34


@dataclass(frozen=True, slots=True)
class DrawnRow:
    """One row: an effect in nats with both intervals; the effect of a number is that of its range among the items.

    Attributes
    ----------
    factor, level
        Its factor, and the level or the range, such as "0.125 to 1".
    is_reference
        Whether it is the level that the others are compared with; its estimate is 0 and it has no intervals.
    estimate, interval, robust_interval
        In nats; an interval is None where there is none.
    p, robust_p
        As in `extensions.factors.result.Effect`.
    """

    factor: str
    level: str
    is_reference: bool
    estimate: float
    interval: tuple[float, float] | None
    robust_interval: tuple[float, float] | None
    p: float | None
    robust_p: float | None


def drawn_rows(effects: FactorEffects) -> tuple[DrawnRow, ...]:
    """Return the rows, factor by factor; none where there is no finite maximum.

    Parameters
    ----------
    effects
        Effects of the factors, as `factor_effects` returns them.

    Returns
    -------
    tuple[DrawnRow, ...]
        A row for each level of a categorical factor, its reference level first, and one for each numeric factor.
        Estimates and intervals are in nats.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from extensions.factors import factor_effects
    >>> answers = from_answers([Answer("flat", "stereo", 10), Answer("stereo", "flat", 30)])
    >>> effects = factor_effects(answers, {"flat": {"view": "flat"}, "stereo": {"view": "stereo"}})
    >>> [(row.factor, row.level, round(row.estimate, 3)) for row in drawn_rows(effects)]
    [('view', 'flat', 0.0), ('view', 'stereo', 1.099)]
    """
    return tuple(row for factor in effects.factors for row in _of_factor(factor, effects))


def _of_factor(factor: Factor, effects: FactorEffects) -> Iterator[DrawnRow]:
    mine = [effect for effect in effects.effects if effect.factor == factor.name]
    if mine and mine[0].reference is not None:
        yield DrawnRow(factor.name, mine[0].reference, True, 0.0, None, None, None, None)
    for effect in mine:
        yield _row(effect, *_reach(factor, effect))


def _reach(factor: Factor, effect: Effect) -> tuple[str, float]:
    """Return what the row is called and what its effect in nats is multiplied by."""
    if factor.kind == "categorical":
        return effect.level, 1.0
    low, high = min(map(float, factor.values)), max(map(float, factor.values))
    ends = (2**low, 2**high) if factor.kind == "log2" else (low, high)
    return f"{ends[0]:.3g} to {ends[1]:.3g}", high - low


def _row(effect: Effect, level: str, reach: float) -> DrawnRow:
    robust = None
    if effect.robust_low is not None and effect.robust_high is not None:
        robust = effect.robust_low * reach, effect.robust_high * reach
    interval = effect.low * reach, effect.high * reach
    estimate = effect.estimate * reach
    return DrawnRow(effect.factor, level, False, estimate, interval, robust, effect.p, effect.robust_p)


def effects_svg(effects: FactorEffects, width_in: float = 6.5) -> str:
    """Return an ``<svg>`` element: effects in nats, a row per level, factor by factor.

    Each bar is the 95 % interval that goes with the verdict: by observers with five of them or more, else the model's
    (``effects.by_observers``). A reference level is a hollow circle at 0. The numbers are those of `drawn_rows`.

    Parameters
    ----------
    effects
        Effects of the factors, as `factor_effects` returns them.
    width_in
        Width of the figure in inches, above 0.

    Returns
    -------
    str
        One ``<svg>`` element, to stand in an HTML page.

    Raises
    ------
    ResultsError
        If there are no effects to draw.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from extensions.factors import factor_effects
    >>> answers = from_answers([Answer("flat", "stereo", 10), Answer("stereo", "flat", 30)])
    >>> effects = factor_effects(answers, {"flat": {"view": "flat"}, "stereo": {"view": "stereo"}})
    >>> effects_svg(effects).startswith("<svg")
    True
    """
    return draw_effects(effects, width_in).svg


def draw_effects(effects: FactorEffects, width_in: float) -> Drawing:
    """Draw what `effects_svg` describes, and raise what it raises."""
    rows = drawn_rows(effects)
    if not rows:
        why = " ".join(effects.separation) or "there are none"
        raise ResultsError(Finding(f"there are no finite effects to draw: {why}", remedy="fit with method='map'"))
    places = _places(rows)
    height_in = 0.75 + 0.31 * (max(places) + 1)
    with drawing("factors", width_in, height_in) as (figure, axes):
        axes.axvline(0, color=INK, linewidth=0.8, zorder=1)
        axes.hlines(places, 0, 1, transform=axes.get_yaxis_transform(), color=FAINT, linewidth=0.7, zorder=0)
        for place, row in zip(places, rows, strict=True):
            level = [place, place]
            ends = row.robust_interval if effects.by_observers else row.interval
            if ends is not None:
                axes.plot(ends, level, color=INK, linewidth=1.3, solid_capstyle="butt", zorder=3)
                axes.plot(ends, level, "|", color=INK, markersize=7, markeredgewidth=1.3, zorder=3)
            face = "white" if row.is_reference else EFFECT
            axes.plot([row.estimate], [place], "o", color=INK, markerfacecolor=face, markersize=7, zorder=5)
        axes.set_yticks(places, [_label(row) for row in rows])
        axes.set_ylim(max(places) + 0.6, -0.6)
        axes.set_xlabel("effect on the strength (nats)", color=INK)
        axes.tick_params(axis="y", length=0, colors=INK)
        axes.tick_params(axis="x", colors=INK)
        axes.spines[["top", "right", "left"]].set_visible(False)
        axes.spines["bottom"].set_color(INK)
        count = len(effects.factors)
        return drawn(figure, f"Effects of {count} factor{'s' if count > 1 else ''} with 95 % intervals")


def _places(rows: Sequence[DrawnRow]) -> list[float]:
    """Return where rows stand, with half a row between factors."""
    places: list[float] = []
    for row, before in zip(rows, (None, *rows), strict=False):
        apart = 1.0 if before is not None and before.factor == row.factor else 1.5
        places.append(places[-1] + apart if places else 0.0)
    return places


def _label(row: DrawnRow) -> str:
    return short(f"{row.factor}: {row.level}", LONGEST_NAME)
