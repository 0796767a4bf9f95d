"""Measures and observers as a page, as blocks for the terminal, and as CSV: what was asked and found, and how."""

from __future__ import annotations

from pathlib import Path

from analysis.records import Header
from analysis.report import fixed, p_words, percent
from documents import counted
from documents.figures import NARROW_IN, WIDE_IN
from documents.pages import (
    Badge,
    Block,
    Cell,
    Column,
    Facts,
    Figure,
    Heading,
    Page,
    Paragraph,
    Section,
    Table,
    write_csv_files,
    write_page,
)
from documents.text import finite
from extensions.agreement.comparison import VERDICT_BY
from extensions.agreement.correlations import KINDS
from extensions.agreement.figures import draw_limits, draw_scores, score_intervals
from extensions.agreement.limits import LimitCheck, LimitTable, Proportion
from extensions.agreement.pairs import PairAccuracy
from extensions.agreement.result import Agreement, Correlation, GroupResult, MeasureResult, same_class


def verdict(result: MeasureResult, agreement: Agreement) -> str:
    """Return whether a measure agrees with observers, in a sentence."""
    title = result.predicted.title
    found = result.whole.correlations[VERDICT_BY]
    if result.adjusted_p is None or found.value is None:
        return f"{title}: it cannot be said, since the measure or the scores are the same for all stimuli of a group."
    rho = f"Spearman's ρ = {fixed(found.value, 2)}{ends(found)}"
    many = f" after Holm's correction for {len(agreement.measures)} measures" if len(agreement.measures) > 1 else ""
    tested = f"{p_words(result.adjusted_p)}{many}"
    if result.decision == "agrees":
        return f"{title} agrees with observers: {rho}, {tested}."
    if result.decision == "cannot be said":
        return (
            f"{title}: it cannot be said, since with so few stimuli even perfect agreement could be luck "
            f"(p at least {agreement.least_p:.2g}{' times the number of measures' if many else ''}); {rho}."
        )
    return f"{title}: no agreement is shown. {rho}, {tested}. That is no proof that there is none."


def ends(found: Correlation) -> str:
    """Return an interval in brackets, or nothing."""
    if found.low is None or found.high is None:
        return ""
    return f" ({fixed(found.low, 2)} to {fixed(found.high, 2)})"


def pairs_words(accuracy: PairAccuracy) -> str:
    """Return the accuracy on pairs in a sentence."""
    if accuracy.share is None:
        return "No pair is distinguished by observers."
    pairs = counted(accuracy.of, "pair", "pairs")
    words = (
        f"Of {pairs} that observers distinguish, it puts {accuracy.right:g} in their order ({percent(accuracy.share)}"
    )
    if accuracy.low is not None and accuracy.high is not None:
        low, high = fixed(100 * accuracy.low, 0), fixed(100 * accuracy.high, 0)
        words += f"; {low} to {high} % with other observers" if low != high else "; the same in the draws of observers"
    return words + ")."


def limit_words(calibration: LimitCheck, unit: str, *, higher: bool) -> tuple[str, ...]:
    """Return what a limit is worth, in sentences."""
    same, stimuli = calibration.same, calibration.stimuli
    of = counted(stimuli, "stimulus", "stimuli")
    sentences = [f"Of {of}, {same} {'is' if same == 1 else 'are'} not distinguished from the photograph by observers."]
    table = calibration.table
    if table is not None:
        sentences.append(
            f"Within the limit of {value(table.limit, unit)} are {_of(table.hit_rate, 'in its class')} and "
            f"{_of(table.false_alarm_rate, 'in others')}: it says what observers say of {table.right.times} of "
            f"{table.right.of}."
        )
    if calibration.area is None or calibration.best is None or calibration.best_table is None:
        sentences.append("All are of one sort, so that no limit can be told from another.")
        return tuple(sentences)
    area = f"Area under the curve {fixed(calibration.area, 2)}"
    if calibration.area_low is not None and calibration.area_high is not None:
        area += f" ({fixed(calibration.area_low, 2)} to {fixed(calibration.area_high, 2)})"
    best = calibration.best_table
    agrees = f"the limit that agrees best is {value(calibration.best, unit)}"
    if calibration.best_low is not None and calibration.best_high is not None:
        agrees += f" ({value(calibration.best_low)} to {value(calibration.best_high, unit)} with other observers)"
    side = "at or above it" if higher else "at or below it"
    hits, alarms = _of(best.hit_rate, "in its class"), _of(best.false_alarm_rate, "in others")
    sentences.append(f"{area}; {agrees}: {side} are {hits} and {alarms}.")
    return tuple(sentences)


def value(number: float, unit: str = "") -> str:
    """Return a value of a measure with its unit."""
    text = "∞" if number == float("inf") else f"{number:.3g}".replace("-", "−")
    return f"{text} {unit}".rstrip()


def _of(rate: Proportion, which: str) -> str:
    if rate.share is None or rate.low is None or rate.high is None:
        return f"none {which}, since there is none"
    low, high = fixed(100 * rate.low, 0), fixed(100 * rate.high, 0)
    return f"{rate.times} of the {rate.of} {which} ({low} to {high} %)"


def group_name(name: str) -> str:
    """Return a group's name; that of the only one is empty."""
    return name or "all stimuli"


def asked(agreement: Agreement) -> str:
    """Return what was asked, in a sentence."""
    groups = agreement.groups
    people = sorted({group.observers for group in groups})
    who = f"{people[0]}" if len(people) == 1 else f"{people[0]} to {people[-1]}"
    stimuli = sum(
        len(group.stimuli) - (photograph in group.stimuli)
        for group, photograph in zip(groups, agreement.photographs, strict=True)
    )
    where = f" in {len(groups)} groups" if len(groups) > 1 else ""
    observers = "observer" if who == "1" else "observers"
    return (
        f"Do measures of the difference from the photograph order {stimuli} stimuli{where} as {who} {observers} did, "
        f"by {groups[0].task}?"
    )


Row = tuple[Cell, ...]
Terms = tuple[tuple[str, str], ...]
HEADINGS = {"pearson": "Pearson's r", "spearman": "Spearman's ρ", "kendall": "Kendall's τ"}


def write_agreement_page(agreement: Agreement, header: Header, output: Path, facts: Terms = ()) -> None:
    """Write a self-contained HTML page on measures and observers, whole or not at all.

    Parameters
    ----------
    agreement
        The results, as `agree` returns them.
    header
        Header of a session: the experiment and its question.
    output
        The page. Its folder is made if it does not exist.
    facts
        Pairs of a term and its value: which pictures were measured, and how they were seen.

    Raises
    ------
    OSError
        If the page cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from analysis.records import new_header
    >>> from extensions.agreement import ObservedGroup, Predicted, agree
    >>> group = ObservedGroup("", "ratings", "points", tuple("abcd"), np.arange(4.0), np.eye(4) < 1, 1, None)
    >>> found = agree([group], ["photo"], [Predicted("blur", "Blur", "px", "lower", (np.arange(4.0),))])
    >>> header = new_header("plates", "01", "s1", "2026-01-31T09:30:00Z", seed=1)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_agreement_page(found, header, Path(folder, "agreement.html"))
    ...     "Do measures" in Path(folder, "agreement.html").read_text(encoding="utf-8")
    True
    """
    page = Page(
        kind="Measures and observers",
        title=header.experiment,
        of="measures and observers",
        question=header.question,
        sentences=(asked(agreement),),
        notes=agreement.notes,
        sections=sections_of(agreement, facts),
    )
    write_page(page, output, private=True)


def write_agreement_csv(agreement: Agreement, folder: Path) -> tuple[Path, ...]:
    """Write the tables of the page as CSV and return the files, each whole or not at all.

    Parameters
    ----------
    agreement
        The results, as `agree` returns them.
    folder
        Where to write; it is made if it does not exist.

    Returns
    -------
    tuple of pathlib.Path
        ``agreement.csv``, ``scores.csv``, ``pairs.csv`` and, where photographs were compared, ``limits.csv``.

    Raises
    ------
    OSError
        If a file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from extensions.agreement import ObservedGroup, Predicted, agree
    >>> group = ObservedGroup("", "ratings", "points", tuple("abcd"), np.arange(4.0), np.eye(4) < 1, 1, None)
    >>> found = agree([group], ["photo"], [Predicted("blur", "Blur", "px", "lower", (np.arange(4.0),))])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     [file.name for file in write_agreement_csv(found, Path(folder))]
    ['agreement.csv', 'scores.csv', 'pairs.csv']
    """
    return write_csv_files(tables_of(agreement), folder)


def agreement_blocks(agreement: Agreement) -> tuple[Block, ...]:
    """Return a table of the measures by group, and in sentences what was found and how sure it is.

    Parameters
    ----------
    agreement
        The results, as `agree` returns them.

    Examples
    --------
    >>> import numpy as np
    >>> from extensions.agreement import ObservedGroup, Predicted, agree
    >>> group = ObservedGroup("", "ratings", "points", tuple("abcd"), np.arange(4.0), np.eye(4) < 1, 1, None)
    >>> noise = Predicted("noise", "Noise", "", "lower", (np.arange(4.0)[::-1],))
    >>> "Noise agrees with observers" in agreement_blocks(agree([group], ["photo"], [noise]))[2].text
    True
    """
    blocks: list[Block] = [Paragraph(asked(agreement)), correlations_table(agreement)]
    for result in agreement.measures:
        one, limit = result.predicted, result.whole.calibration
        said = limit_words(limit, one.unit, higher=one.better == "higher") if limit else []
        blocks += [Heading(verdict(result, agreement)), Paragraph(pairs_words(result.whole.accuracy))]
        blocks += map(Paragraph, said)
    remarks = [f"{one.predicted.title}: {remark}." for one in agreement.measures for remark in one.predicted.remarks]
    return (*blocks, *(Paragraph(note, mark=Badge("Note", "open")) for note in (*agreement.notes, *remarks)))


def sections_of(agreement: Agreement, facts: Terms) -> tuple[Section, ...]:
    """Return the sections; ``facts`` say which pictures were measured and how they were seen."""
    return (
        _found(agreement),
        *(_measure(agreement, result) for result in agreement.measures),
        Section("stimuli", "Stimuli", (stimuli_table(agreement), pairs_table(agreement))),
        _methods(agreement, facts),
    )


def tables_of(agreement: Agreement) -> tuple[Table, ...]:
    """Return the tables that are written as CSV."""
    tables = [correlations_table(agreement), stimuli_table(agreement), pairs_table(agreement)]
    if any(result.whole.calibration for result in agreement.measures):
        tables.append(limits_table(agreement))
    return tuple(tables)


def _found(agreement: Agreement) -> Section:
    blocks: list[Block] = [Paragraph(verdict(result, agreement)) for result in agreement.measures]
    blocks.append(correlations_table(agreement))
    blocks.append(
        Paragraph(
            "Correlations are positive where the measure agrees. Intervals are 95 % limits for other observers of the "
            "kind who see these same stimuli: they say nothing of other stimuli. The p value does: it is how often a "
            "measure that has nothing to do with the stimuli would agree as well. The photograph itself takes no part.",
            small=True,
        )
    )
    if any(result.whole.calibration for result in agreement.measures):
        blocks.append(limits_table(agreement))
    return Section("found", "What was found", tuple(blocks))


def correlations_table(agreement: Agreement) -> Table:
    """Return the correlations and pairs of each measure, by group and over all."""
    columns = [Column("Measure", "measure"), Column("Group", "group"), Column("Stimuli", "stimuli", "number")]
    for kind in KINDS:
        columns += [Column(HEADINGS[kind], kind, "number", 2), Column("95 %", f"{kind}_interval", "interval", 2)]
        columns.append(Column("p", f"{kind}_p", "p"))
    columns += [
        Column("Pairs told apart", "pairs", "number"),
        Column("In order", "pairs_right", "number", 1),
        Column("Share", "pairs_share", "number", 2),
        Column("95 %", "pairs_interval", "interval", 2),
        Column("p", "pairs_p", "p"),
    ]
    rows: list[Row] = []
    sizes = [
        len(group.stimuli) - (photograph in group.stimuli)
        for group, photograph in zip(agreement.groups, agreement.photographs, strict=True)
    ]
    for result in agreement.measures:
        several = len(agreement.groups) > 1
        for group, size, found in zip(agreement.groups, sizes, result.groups, strict=True) if several else ():
            rows.append(_row(result, group_name(group.name), size, found))
        rows.append(_row(result, "over all groups" if several else "all stimuli", sum(sizes), result.whole))
    return Table("agreement", "Measures and observers", tuple(columns), tuple(rows))


def _row(result: MeasureResult, group: str, stimuli: int, found: GroupResult) -> Row:
    cells: list[Cell] = [result.predicted.title, group, stimuli]
    for kind in KINDS:
        one = found.correlations[kind]
        cells += [one.value, (one.low, one.high), one.p]
    pairs = found.accuracy
    return (*cells, pairs.of, pairs.right, pairs.share, (pairs.low, pairs.high), pairs.p)


def limits_table(agreement: Agreement) -> Table:
    """Return what each measure's limit says against the classes, and the limit that agrees best."""
    columns = (
        Column("Measure", "measure"),
        Column("Limit", "limit"),
        Column("Value", "value", "number", 2),
        Column("95 %", "value_interval", "interval", 2),
        Column("In the photograph's class", "same", "number"),
        Column("of them within", "hits", "number"),
        Column("Hit rate, 95 %", "hit_rate", "interval", 2),
        Column("In others", "others", "number"),
        Column("of them within", "false_alarms", "number"),
        Column("False alarm rate, 95 %", "false_alarm_rate", "interval", 2),
        Column("Area under the curve", "area", "number", 2),
        Column("95 %", "area_interval", "interval", 2),
    )
    rows: list[Row] = []
    for result in agreement.measures:
        found = result.whole.calibration
        if found is None:
            continue
        area: tuple[Cell, ...] = (found.area, (found.area_low, found.area_high))
        none: tuple[Cell, ...] = (None, (None, None))
        if found.table is not None:
            rows.append((result.predicted.title, "as set", found.table.limit, none[1], *_counts(found.table), *area))
        if found.best is not None and found.best_table is not None:
            ends = (found.best_low, found.best_high)
            rows.append(
                (result.predicted.title, "agrees best", finite(found.best), ends, *_counts(found.best_table), *area)
            )
        elif found.table is None:
            other = found.stimuli - found.same
            rows.append((result.predicted.title, "none", *none, found.same, *none, other, *none, *none))
    return Table("limits", "Limits, and the photograph's class", columns, tuple(rows))


def _counts(table: LimitTable) -> Row:
    hit, alarm = table.hit_rate, table.false_alarm_rate
    return hit.of, hit.times, (hit.low, hit.high), alarm.of, alarm.times, (alarm.low, alarm.high)


def _measure(agreement: Agreement, result: MeasureResult) -> Section:
    one = result.predicted
    figure = Figure(
        f"scores_{one.name}",
        draw_scores(agreement, result, WIDE_IN),
        draw_scores(agreement, result, NARROW_IN),
        "Each dot is a stimulus, with the 95 % interval of its score over observers. Filled: in one class with the "
        "photograph, which is the star where it was compared; grey: no class to compare. Dashed: the measure's limit.",
    )
    blocks: list[Block] = [figure, Paragraph(pairs_words(result.whole.accuracy))]
    calibration = result.whole.calibration
    if calibration is not None:
        blocks.append(Heading("The limit"))
        sentences = limit_words(calibration, one.unit, higher=one.better == "higher")
        blocks += [Paragraph(sentence) for sentence in sentences]
        if calibration.curve:
            blocks.append(
                Figure(
                    f"limits_{one.name}",
                    draw_limits(agreement, result, calibration, WIDE_IN),
                    draw_limits(agreement, result, calibration, NARROW_IN),
                    "Left: the stimuli not distinguished from the photograph, and the others. Dashed: the "
                    "measure's limit; line and band: the limit that agrees best, with its 95 % interval. Right: hits "
                    "against false alarms of every limit.",
                )
            )
    return Section(f"measure-{one.name}", one.title, tuple(blocks))


def stimuli_table(agreement: Agreement) -> Table:
    """Return each stimulus's score, class and measures."""
    columns = [
        Column("Stimulus", "stimulus"),
        Column("Group", "group"),
        Column("Photograph", "photograph"),
        Column("Score", "score", "number", 3),
        Column("95 %", "score_interval", "interval", 3),
        Column("Photograph's class", "same_class"),
    ]
    columns += [
        Column(result.predicted.title, result.predicted.name, "number", 3, result.predicted.unit)
        for result in agreement.measures
    ]
    rows: list[Row] = []
    for number, (group, photograph) in enumerate(zip(agreement.groups, agreement.photographs, strict=True)):
        intervals = score_intervals(agreement, number)
        for place, stimulus in enumerate(group.stimuli):
            same = same_class(group, photograph, place)
            rows.append(
                (
                    stimulus,
                    group_name(group.name),
                    photograph,
                    float(group.scores[place]),
                    intervals[place],
                    "–" if same is None else "yes" if same else "no",
                    *(float(result.predicted.values[number][place]) for result in agreement.measures),
                )
            )
    return Table("scores", "Scores and measures", tuple(columns), tuple(rows))


def pairs_table(agreement: Agreement) -> Table:
    """Return every pair of stimuli, and whether each measure puts the one with the higher score first."""
    columns = [
        Column("Better", "better"),
        Column("Worse", "worse"),
        Column("Group", "group"),
        Column("Difference of scores", "difference", "number", 3),
        Column("Told apart", "told_apart"),
    ]
    columns += [Column(result.predicted.title, result.predicted.name) for result in agreement.measures]
    said = {1: "yes", 0: "the same", -1: "no"}
    rows: list[Row] = []
    for number, group in enumerate(agreement.groups):
        for pair in agreement.pairs(number):
            told = "yes" if pair.told_apart else "no"
            measures = (said[pair.predicted[result.predicted.name]] for result in agreement.measures)
            rows.append((pair.better, pair.worse, group_name(group.name), pair.difference, told, *measures))
    return Table(
        "pairs", "Pairs, and whether each measure puts the better one first", tuple(columns), tuple(rows), True
    )


def _methods(agreement: Agreement, facts: tuple[tuple[str, str], ...]) -> Section:
    sentences = (
        "Scores and classes are those of the report. Correlations: Pearson's, Spearman's, and Kendall's τ-b "
        "[Kendall1945]. Their intervals invert a test with the errors of the bootstrap over observers, widened by "
        "Student's law for few observers [Carpenter1999]: percentiles of the bootstrap never contain the correlation "
        "of a measure that agrees perfectly, since error lowers every sample's.",
        "p values are by permutation of the stimuli within each group [Fisher1935], one-sided. A measure is said to "
        f"agree where p of Spearman's correlation, by Holm's correction for the number of measures, is at most "
        f"{agreement.alpha:g}.",
        "Pairs that observers distinguish differ significantly by the tests that the classes follow from; a stimulus "
        "shares a class with the photograph where their difference is not significant. That is no proof of equality: "
        "more observers tell more apart, and the limit that agrees best then falls. Intervals of shares of pairs, of "
        "the area and of the best limit are percentiles of the bootstrap, widened for few observers; those of hit and "
        "false alarm rates are Wilson's [Wilson1927], over stimuli.",
    )
    remarks = [f"{one.predicted.title}: {remark}." for one in agreement.measures for remark in one.predicted.remarks]
    blocks: tuple[Block, ...] = (
        *(Paragraph(sentence, small=True) for sentence in [*sentences, *remarks]),
        Facts(facts),
    )
    return Section("methods", "How it was done", blocks)
