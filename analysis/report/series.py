"""Choices from series: Figures 4.14, 4.15 and 4.16 of the thesis [Medina2016], steps, tests and agreement."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from analysis.classes.conclusions import Conclusion, with_shares
from analysis.classes.multiplicity import ADJUSTMENT_NAMES
from analysis.comparisons.comparisons import observer_parts
from analysis.errors import ResultsError
from analysis.kinds.best_of_series import BestOfSeriesRecord
from analysis.records.session_record import SessionLog
from analysis.report.agreement import series_agreement
from analysis.report.bars import BarFigure
from analysis.report.part import Part, draws_of_means, draws_of_weights
from analysis.report.references import Citations
from analysis.report.words import as_words, counted, fixed
from analysis.series import paired_tests
from analysis.series.just_noticeable import StepSize
from analysis.series.observer_means import Estimated
from analysis.series.summary import SeriesSummary, all_tests, conclusions_of_tests, summarise_series
from documents import Finding
from documents.figures import NARROW_IN, WIDE_IN
from documents.pages import Block, Cell, Column, Figure, Paragraph, Section, Table

FEW_DRAWS = 9999  # for tests of which only the verdict counts
_HOLM = ADJUSTMENT_NAMES["holm"]


def series_part(sessions: Sequence[SessionLog]) -> Part | None:
    """Return what a report says of choices from series; None without any."""
    if not any(session.of(BestOfSeriesRecord) for session in sessions):
        return None
    summary = summarise_series(sessions)
    return Part(
        key="series",
        result=summary,
        sentences=(summary.sentence,),
        notes=[note for note in summary.notes if "simulated" not in note],
        sections=lambda _: series_sections(summary),
        conclusions=lambda: _conclusions(summary),
        analysis=lambda cited: _analysis(summary, cited),
        draws=tuple(_draws(summary)),
        p_values=tuple(_p_values(summary)),
        families=tuple(_families(summary)),
        effects="Effect sizes of series are shares of choices, and of ratings the mean differences with 95 % "
        "intervals, Cohen's d of paired differences, and Kendall's W.",
    )


def _conclusions(summary: SeriesSummary) -> tuple[Conclusion, ...]:
    """Return what is concluded of ratings and choices of every two kinds of series, and of ratings of two paints."""
    others: list[Conclusion] = []
    choices = summary.choices
    part, names = observer_parts(choices.observers)
    for number in range(len(names) - 1):
        kept = tuple(choice for choice in choices.choices if part[choice.observer] != number)
        others += conclusions_of_tests(*all_tests(replace(choices, choices=kept), FEW_DRAWS))
    return with_shares(summary.conclusions, others)


def _analysis(summary: SeriesSummary, cited: Citations) -> str:
    weighted = f"{weighting(summary)} The scores are those of {cited.cite('Medina2016')}. " if summary.weight else ""
    return (
        f"{weighted}Intervals are percentile intervals by bootstrap over observers, at levels widened for few "
        f"observers {cited.cite('Hesterberg2015')}. The just noticeable step is 0.674 standard deviations of an "
        f"observer's matches {cited.cite('Gescheider1997')}. Tests between series are permutation tests within "
        f"observers, with Holm's correction {cited.cite('Holm1979')}; several series are compared by Friedman's "
        f"test {cited.cite('Friedman1937')}."
    )


def _draws(summary: SeriesSummary) -> Iterator[str]:
    yield draws_of_means()
    observers = len(summary.choices.observers)
    if any(step.fit_by_observers for step in summary.steps):
        yield draws_of_weights(observers)
    if observers > paired_tests.MOST_EXACT and (summary.kind_tests or summary.paint_tests or summary.choice_tests):
        draws, seed = paired_tests.DRAWS, paired_tests.SEED
        yield f"{draws:,} random signs of the observers for each permutation test (seed {seed})"
    if any(test.p is not None for test in summary.level_tests):
        draws, seed = paired_tests.COCHRAN_DRAWS, paired_tests.COCHRAN_SEED
        yield f"{draws:,} permutations for each test of a level (seed {seed})"


def _p_values(summary: SeriesSummary) -> Iterator[str]:
    if summary.kind_tests or summary.paint_tests:
        yield (
            "Of the p values of two conditions that of the permutation test after Holm's correction is to be "
            "reported; Nemenyi's stands beside it."
        )
    if any(step.fit_by_observers for step in summary.steps):
        yield "The fit of a step is judged by the p value by observers."


def _families(summary: SeriesSummary) -> Iterator[str]:
    for what, tests in (("kinds of series", summary.kind_tests), ("groups of pictures", summary.paint_tests)):
        for scale, test in tests.items():
            yield f"{counted(len(test.pairs), 'pair')} of {what} rated for {scale}, with {_HOLM}"
    if summary.choice_tests:
        yield f"the choices of {counted(len(summary.choice_tests), 'pair')} of kinds of series, with {_HOLM}"
    if tested := [test for test in summary.level_tests if test.p is not None]:
        yield f"the choices of {counted(len(tested), 'level')}, with {_HOLM}"
    for kind in dict.fromkeys(test.kind for test in summary.neighbours):
        number = sum(test.kind == kind for test in summary.neighbours)
        yield f"{counted(number, 'pair')} of neighbouring levels of {kind}, with {_HOLM}"


def series_sections(summary: SeriesSummary) -> list[Section]:
    """Return the sections on choices, ratings, steps, tests and agreement."""
    choices = _figure(
        score_figure(summary),
        "series_scores",
        f"{weighting(summary)} 95 % intervals are by bootstrap over observers.",
    )
    sections = [Section("series", "Chosen pictures", (choices, _pictures(summary)))]
    ratings: list[Block] = [
        _figure(
            rating_figure(summary, scale),
            f"series_{scale}",
            "95 % intervals are by bootstrap over observers.",
        )
        for scale in summary.ratings
    ]
    if ratings:
        sections.append(Section("series-ratings", "Ratings of the chosen pictures", tuple(ratings)))
    sections.append(Section("steps", "Just noticeable step", _steps(summary)))
    tests = [block for block in (*_rating_tests(summary), _choice_tests(summary)) if block is not None]
    if tests:
        sections.append(Section("series-tests", "Do the series differ?", tuple(tests)))
    sections.append(Section("series-agreement", "Do the observers agree?", series_agreement(summary.agreement)))
    return sections


def weighting(summary: SeriesSummary) -> str:
    """Return the sentence that says what the choices are weighted by."""
    return f"Choices are weighted by their rated {summary.weight}." if summary.weight else "Choices are not weighted."


def _figure(figure: BarFigure, name: str, caption: str) -> Figure:
    columns = [Column(figure.group_title or "Group", "group")]
    for bar in figure.bars:
        columns += [Column(bar, bar, "number", 2), Column("95 %", bar, "interval", 2)]
    rows = []
    for group, estimates in zip(figure.groups, figure.estimates, strict=True):
        cells: list[Cell] = [group]
        for estimate in estimates:
            cells += [_value(estimate), _interval(estimate)]
        rows.append(tuple(cells))
    table = Table(name, figure.title, tuple(columns), tuple(rows))
    return Figure(name, figure.draw(WIDE_IN), figure.draw(NARROW_IN), f"{figure.title}. {caption}", table)


def _value(estimate: Estimated | None) -> float | None:
    return None if estimate is None else estimate.value


def _interval(estimate: Estimated | None) -> tuple[float | None, float | None]:
    return (None, None) if estimate is None else (estimate.low, estimate.high)


def _pictures(summary: SeriesSummary) -> Table:
    columns = (
        Column("Picture", "stimulus"),
        Column("Series", "series"),
        Column("Chosen", "chosen", "number"),
        Column("of", "of", "number"),
        Column("Share", "share", "number", 2),
        Column("95 %", "share", "interval", 2),
        Column("Score", "score", "number", 2),
        Column("95 %", "score", "interval", 2),
        Column("Seen (s)", "dwell_s", "number", 1),
    )
    rows = tuple(
        (
            picture.stimulus,
            picture.series,
            picture.chosen,
            picture.of,
            picture.share.value,
            (picture.share.low, picture.share.high),
            _value(picture.score),
            _interval(picture.score),
            picture.dwell_s.value,
        )
        for picture in summary.pictures
    )
    return Table("series_pictures", f"All {len(rows)} pictures", columns, rows, folded=True)


def _steps(summary: SeriesSummary) -> tuple[Block, ...]:
    columns = (
        Column("Series", "kind"),
        Column("Choices", "choices", "number"),
        Column("Mean match", "match", "number", 4),
        Column("Step (ratio)", "ratio", "number", 2),
        Column("Step on the axis", "step", "number", 3),
        Column("95 %", "step", "interval", 3),
        Column("p (fit)", "fit_p", "p"),
        Column("Not estimated because", "reason"),
    )
    rows = tuple(
        (
            step.kind,
            step.choices,
            step.match,
            step.ratio,
            step.step,
            step.step_interval or (None, None),
            step.fit_by_observers.p if step.fit_by_observers else step.fit_p,
            step.reason or None,
        )
        for step in summary.steps
    )
    words = (
        "The step that is noticed in 75 % of cases, from the standard deviation of an observer's choices, which are "
        "modelled as matches with a normal error on the axis of the series"
    )
    words += _axis_words(summary.steps) + " A ratio of 2 means that a level must be doubled to be noticed."
    words += " The p value of the fit is by bootstrap over observers where there are five or more."
    used = len(columns) if any(step.reason for step in summary.steps) else len(columns) - 1
    table = Table("series_steps", "Of one observer", columns[:used], tuple(row[:used] for row in rows))
    return table, Paragraph(words, small=True)


def _axis_words(steps: tuple[StepSize, ...]) -> str:
    return " (the logarithm of the level)." if any(step.axis == "log" for step in steps) else "."


def _rating_tests(summary: SeriesSummary) -> list[Block]:
    columns = (
        Column("Between", "between"),
        Column("Difference", "difference", "number", 2),
        Column("95 %", "difference", "interval", 2),
        Column("Cohen's d_z", "effect_d_z", "number", 2),
        Column("p", "p", "p"),
        Column("p (Holm)", "p_holm", "p"),
        Column("p (Nemenyi)", "p_nemenyi", "p"),
    )
    tables: list[Block] = []
    for what, tests in (("kind", summary.kind_tests), ("paint", summary.paint_tests)):
        for scale, test in tests.items():
            by = summary.choices.design.by if what == "kind" else summary.choices.design.across
            whole = (
                f"Friedman's χ² = {fixed(test.statistic, 2)} on {test.df} df, p = {fixed(test.p, 3)}, Kendall's W = "
                f"{fixed(test.w, 2)}"
                if test.p is not None
                else "every observer rates all of them equally"
            )
            rows = tuple(
                (
                    f"{pair.one} − {pair.other}",
                    pair.difference.value,
                    (pair.difference.low, pair.difference.high),
                    pair.effect,
                    pair.p,
                    pair.p_holm,
                    pair.p_nemenyi,
                )
                for pair in test.pairs
            )
            title = f"Mean {scale} by {by or what}: {whole}"
            tables.append(Table(f"series_tests_{scale}_{what}", title, columns, rows, folded=len(rows) > 6))
    return tables


def _choice_tests(summary: SeriesSummary) -> Table | None:
    if not summary.choice_tests:
        return None
    columns = (
        Column("Between", "between"),
        Column("Mean shift (places)", "shift", "number", 2),
        Column("Stuart-Maxwell", "statistic", "number", 2),
        Column("df", "df", "number"),
        Column("p", "p", "p"),
        Column("p (Holm)", "p_holm", "p"),
    )
    rows = tuple(
        (f"{test.one} − {test.other}", test.shift, test.statistic, test.df, test.p, test.p_holm)
        for test in summary.choice_tests
    )
    title = "Do choices have the same levels? Permutation tests within observers"
    return Table("series_choice_tests", title, columns, rows)


def score_figure(summary: SeriesSummary) -> BarFigure:
    """Return the score of each level, a bar for each kind of series: Figure 4.14.

    Without scores, it is the share of choices.

    Parameters
    ----------
    summary
        The results from choices in series.

    Returns
    -------
    BarFigure
        Mean scores, or shares of choices (0 to 1), with 95 % intervals: a group for each level, a bar for each kind of
        series; None where a kind has no such level.
    """
    scored = summary.weight is not None
    plan = summary.choices.design
    by_cell: dict[tuple[float, str], Estimated | None] = {
        (level.level, level.kind): level.score if scored else level.share for level in summary.levels
    }
    levels = plan.levels()
    return BarFigure(
        f"Score of each picture: choices weighted by {summary.weight}" if scored else "Share of choices",
        as_words(plan.along or "place in the series"),
        "mean score" if scored else "share of choices",
        tuple(f"{level:g}" for level in levels),
        plan.kinds,
        tuple(tuple(by_cell.get((level, kind)) for kind in plan.kinds) for level in levels),
    )


def rating_figure(summary: SeriesSummary, scale: str) -> BarFigure:
    """Return the mean rating of each paint, a bar for each kind of series: Figures 4.15 and 4.16.

    The thesis draws ``difficulty`` reversed: there a low number means hard to discern, here it is as rated, and a high
    number means hard.

    Parameters
    ----------
    summary
        The results from choices in series.
    scale
        Name of the rating scale, such as ``similarity``.

    Returns
    -------
    BarFigure
        Mean ratings in points of the scale with 95 % intervals: a group for each paint, a bar for each kind of series.

    Raises
    ------
    ResultsError
        If nothing was rated on such a scale.
    """
    if scale not in summary.ratings:
        known = ", ".join(summary.ratings)
        remedy = f"one of: {known}" if known else "ask for ratings in the block"
        raise ResultsError(Finding(f"no choice was rated on a scale '{scale}'", remedy=remedy))
    plan = summary.choices.design
    by_cell: dict[tuple[str | None, str | None], Estimated] = {
        (cell.paint, cell.kind): cell.mean for cell in summary.ratings[scale]
    }
    return BarFigure(
        f"Mean {as_words(scale)} by {as_words(plan.across or 'series')}",
        as_words(plan.across or ""),
        f"mean {as_words(scale)}",
        plan.paints,
        plan.kinds,
        tuple(tuple(by_cell[paint, kind] for kind in plan.kinds) for paint in plan.paints),
    )
