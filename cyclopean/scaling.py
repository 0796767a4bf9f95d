"""What the answers come to: scores, effects of factors, a line for each observer, and how many observers to ask."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from cyclopean.result import Result
from documents import Finding, InputError
from documents.options import made, taking
from documents.pages import Block, Section
from runner.reports import ScoresOptions

if TYPE_CHECKING:
    from analysis.comparisons import Coded, CodedTable, Comparisons
    from analysis.observers import ObserverTable
    from analysis.records import SessionLog
    from extensions.factors import FactorEffects
    from extensions.power import PowerStudy

Answers = pd.DataFrame | str | Path


@taking(ScoresOptions, "observer_scores")
def scores(answers: Answers, *, with_simulated: bool = False, **options: Any) -> Result[Any]:
    """Fit scores and perceptual classes to paired comparisons, as `cyclopean scores` does and with the same options.

    Parameters
    ----------
    answers
        A folder of results, a CSV table, the DataFrame of `read_results`, or a DataFrame with the columns ``winner``
        and ``loser`` and, if there are any, ``count``, ``observer``, ``first`` and ``outcome``; for pairs within
        scenes also ``group``, ``scene`` or ``content``. Or a table or a DataFrame of another layout: pwcmp's, choices
        among items, a square matrix of counts (also a MAT-file). Lines in which a value is missing (NaN, None, or a
        word such as ``NA``) are left out, with a Python warning that names them.
    with_simulated
        Whether simulated observers count beside people. Without it, those of a folder count only where no person
        answered, and a DataFrame of trials with both is refused.
    **options
        Those of `runner.reports.ScoresOptions` by their names, such as ``method="firth"``, ``covariance="sandwich"`` or
        ``margin="0.5jnd"``; what is asked beside the scores is in ``further`` of the result.

    Returns
    -------
    Result
        A row for each item, best first: wins, comparisons, log score ``theta`` in nats with its standard error ``se``,
        ``score`` (they sum to 1), ``log10_score``, ``class``, and ``jnd``: ``theta`` in just noticeable differences.
        Where there are groups, a row for each item of each ``group``, and where items recur of all groups together,
        with no name of a group; ``value.agreement`` says whether the groups agree. With ``pwcmp``: wins, comparisons,
        ``jod`` with the ends ``jod_low`` and ``jod_high`` of its interval, and ``class``; ``value.observers`` says how
        much each observer's answers differ from the others'. With ``observers="random"``: those of the typical
        observer.

    Raises
    ------
    InputError
        If the answers cannot be read, hold no comparison, or an option is unknown, out of range, or does not go with
        another.

    Examples
    --------
    >>> import pandas as pd
    >>> answers = pd.DataFrame({"winner": ["a", "a", "b", "b"], "loser": ["b", "b", "a", "a"], "count": [6, 3, 2, 1]})
    >>> scores(answers).to_frame()[["name", "score", "class"]]
      name  score class
    0    a   0.75     1
    1    b   0.25     1
    """
    from runner.reports import score_table

    asked = made(ScoresOptions, options)
    table, common = _with_common_names(
        answers, asked.layout, asked.codes, with_simulated=with_simulated, keep_na=asked.keep_na
    )
    scored = score_table(table, asked, common=common)
    return Result(
        scored.value, scored.rows, scored.title, scored.all_further, lambda: _section(scored.title, scored.told())
    )


@contextmanager
def _extension(name: str) -> Iterator[None]:
    """Say which extension of ours is not there, and what to install."""
    try:
        yield
    except ModuleNotFoundError as error:
        what = f"the extension '{name}' is not here"
        raise InputError(Finding(what, remedy="install cyclopean again, with extensions/")) from error


def _section(title: str, blocks: Iterable[Block]) -> list[Section]:
    return [Section("result", title, tuple(blocks))]


def effects(
    answers: Answers,
    factors: Mapping[str, Mapping[str, str | float]] | None = None,
    *,
    use: Sequence[str] | None = None,
    method: Literal["ml", "map"] = "ml",
    prior_sd: float = 2.0,
    with_simulated: bool = False,
    keep_na: bool = False,
) -> Result[FactorEffects]:
    """Fit what stereo, exposure and other factors of the stimuli do to the scores.

    Parameters
    ----------
    answers
        As for `scores`.
    factors
        The factors of each stimulus by name, such as ``{"a": {"view": "stereo"}, "b": {"view": "flat"}}``; None takes
        those of a folder of results.
    use
        The factors in the model, in order; all of them if None.
    method, prior_sd
        ``ml``, or ``map`` where a level always won, as `extensions.factors.factor_effects` has them.
    with_simulated, keep_na
        As for `scores`.

    Returns
    -------
    Result
        A row for each effect: the estimate in nats with its standard error, interval and p. ``value.tests`` holds a
        likelihood-ratio test of each factor.

    Raises
    ------
    InputError
        If the answers cannot be read, a stimulus has no factors, no factor varies, or the extension is not installed.

    Examples
    --------
    >>> import pandas as pd
    >>> answers = pd.DataFrame({"winner": list("abacbc"), "loser": list("bacacb"), "count": [9, 3, 8, 4, 7, 5]})
    >>> gloss = {"a": {"gloss": 3.0}, "b": {"gloss": 2.0}, "c": {"gloss": 1.0}}
    >>> effects(answers, gloss).to_frame()[["factor", "level", "estimate"]].round(2)
      factor     level  estimate
    0  gloss  per unit      0.47
    """
    with _extension("factors"):
        from extensions.factors import factor_effects, factors_section, session_factors

    if factors is None:
        if _is_table(answers):
            remedy = "give factors={'name': {'view': 'stereo'}, ...}, or a folder of results"
            raise InputError(Finding("a table of answers does not name the factors of its stimuli", remedy=remedy))
        factors = session_factors(_logs(answers, with_simulated=with_simulated))
    table = comparisons(answers, with_simulated=with_simulated, keep_na=keep_na)
    result = factor_effects(table, factors, use=use, method=method, prior_sd=prior_sd)
    rows = [effect.to_json() for effect in result.effects]
    names = ", ".join(factor.name for factor in result.factors)
    title = " ".join(result.problem_lines) or f"Effects of {names} on the scores of {len(result.items)} items, in nats"
    return Result(result, rows, title, find_sections=lambda: [factors_section(result)])


def observers(answers: Answers, *, with_simulated: bool = False, keep_na: bool = False) -> Result[ObserverTable]:
    """Describe each observer: answers, consistency, agreement with the others, side bias, response times.

    Parameters
    ----------
    answers
        As for `scores`; response times, catch trials and vision tests are known from a folder of results only.
    with_simulated, keep_na
        As for `scores`.

    Returns
    -------
    Result
        A row for each observer; ``value.concordance`` says how well they agree.

    Raises
    ------
    InputError
        If the answers cannot be read or hold no comparison.

    Examples
    --------
    >>> import pandas as pd
    >>> answers = pd.DataFrame({"winner": list("aab"), "loser": list("bcc"), "observer": ["01"] * 3})
    >>> observers(answers).to_frame()[["observer", "answers", "consistency.circular_triads"]]
      observer  answers  consistency.circular_triads
    0       01      3.0                          0.0
    """
    from analysis.observers import observers_in_comparisons, observers_in_sessions
    from analysis.report import observers_section

    if _is_table(answers):
        table = observers_in_comparisons(comparisons(answers, with_simulated=with_simulated, keep_na=keep_na))
    else:
        table = observers_in_sessions(_logs(answers, with_simulated=with_simulated))
    rows = [line.to_json() for line in table.lines]
    return Result(table, rows, f"{len(rows)} observers", find_sections=lambda: [observers_section(table, None)])


def power(experiment: str | Path, numbers_of_observers: Sequence[int], **options: Any) -> Result[PowerStudy]:
    """Simulate studies, to plan how many observers to ask, as `cyclopean power` does and with the same options.

    Parameters
    ----------
    experiment
        An experiment file with a block of all pairs; its stimuli need not be built.
    numbers_of_observers
        The numbers to try.
    **options
        Those of `extensions.power.PowerOptions` by their names, such as ``replicates=100``, ``observer_sd=0.5``, or
        ``scores=``: a file of simulated observers, results or a table of a pilot study, or what
        `cyclopean scores --json` printed.

    Returns
    -------
    Result
        A row for each number of observers; ``title`` says how many are needed.

    Raises
    ------
    InputError
        If a file is wrong, the experiment compares no pairs of a fixed number, an option is out of range, or the
        extension is not installed.

    Examples
    --------
    >>> study = power("experiments/dynamic_range.yaml", [20], replicates=50)
    >>> study.to_frame()["observers"].tolist()
    [20]
    """
    with _extension("power"):
        from extensions.power import PowerOptions, power_blocks, study_power

    asked = made(PowerOptions, {**options, "observers": tuple(numbers_of_observers)})
    study = study_power(Path(experiment), asked)
    answer = study.to_json()
    sizes = [
        ({"group": group["name"]} if "name" in group else {})
        | {key: value for key, value in size.items() if key not in ("items", "pairs")}
        for group in answer.get("groups", [answer])
        for size in group["sizes"]
    ]
    return Result(study, sizes, study.needed.sentence, find_sections=lambda: _section("", power_blocks(study.needed)))


with suppress(ModuleNotFoundError):  # without it, all else of here is as it is
    from extensions.power import PowerOptions

    taking(PowerOptions, "observers")(power)


def comparisons(
    answers: Answers,
    layout: str | None = None,
    choice_codes: Sequence[str] = (),
    *,
    with_simulated: bool = False,
    keep_na: bool = False,
) -> Comparisons:
    """Return the paired comparisons in ``answers``, whichever form they have; the parameters are those of `scores`.

    Raises
    ------
    InputError
        If they cannot be read or hold no comparison.
    """
    from analysis.comparisons import from_sessions, read_any

    if not _is_table(answers):
        return from_sessions(_logs(answers, with_simulated=with_simulated))
    if not isinstance(answers, pd.DataFrame):
        return read_any(answers, layout=layout, choice_codes=choice_codes, keep_na=keep_na).warned()
    table = _counted_together(answers) if with_simulated else answers
    # Names of trials, as `read_results` gives them, are those of the sessions' records.
    keep_na = keep_na or {"experiment", "kind", "chosen", "rejected"} <= set(answers)
    columns = _as_columns(table, "" if keep_na else "NA")
    return read_any(
        columns, "the DataFrame, as CSV", layout=layout, choice_codes=choice_codes, keep_na=keep_na
    ).warned()


def _as_columns(table: pd.DataFrame, missing: str) -> CodedTable:
    """Return a frame as texts, with its index where that names observers or the like, or the rows of a matrix.

    Raises
    ------
    InputError
        If rows or columns have names of several levels.
    """
    from analysis.comparisons import KINDS, CodedTable

    for axis, words in ((table.columns, "columns"), (table.index, "rows")):
        if axis.nlevels > 1:
            remedy = "table.reset_index()" if words == "rows" else "table.columns = ['winner', 'loser', 'observer']"
            what = f"the DataFrame's {words} have names of {axis.nlevels} levels"
            raise InputError(Finding(what, remedy=f"give each one name, such as by {remedy}"))
    # Of trials, pairs are compared within groups where all of them have one.
    grouped = {"kind", "group"} <= set(table) and table.columns.is_unique
    if grouped and table["group"][table["kind"].isin(KINDS)].isna().any():
        table = table.drop(columns="group")
    # The names of a matrix's rows stand in its index. What was an index before, such as observers, has a name.
    items = set(table.columns.astype(str))
    matrix = set(table.index[:1].astype(str)) <= items == set(table.index.astype(str))
    named = table.index.name is not None and str(table.index.name) not in table.columns
    names = ["" if name is None else str(name) for name in table.columns]
    columns = [table.iloc[:, place] for place in range(len(names))]
    if matrix or named:
        names.insert(0, "" if table.index.name is None else str(table.index.name))
        columns.insert(0, table.index.to_series())
    return CodedTable(names, [_coded(column, missing) for column in columns])


def _coded(column: pd.Series, missing: str) -> Coded:
    """Return a column as the texts that it has in CSV."""
    from analysis.comparisons import Coded

    code: NDArray[np.integer[Any]]
    distinct: Any
    if isinstance(column.dtype, pd.CategoricalDtype):
        code, distinct = column.cat.codes.to_numpy(), column.cat.categories
    elif column.dtype == object and pd.api.types.infer_dtype(column) not in ("string", "empty"):
        # 1, 1.0 and True are equal, and their texts differ; a list has no place among distinct values.
        code, distinct = pd.factorize(np.array(_written(column, missing), dtype=object))
    else:
        code, distinct = pd.factorize(column)
    texts = distinct.tolist()
    if not all(isinstance(text, str) for text in texts):
        texts = _written(distinct, missing)
    return Coded([*texts, missing], np.where(code < 0, len(texts), code))


def _written(values: Any, missing: str) -> list[str]:
    """Return the texts of values in CSV."""
    text = pd.Series(values).to_csv(index=False, header=False, na_rep=missing, float_format=_number)
    return [row[0] for row in csv.reader(io.StringIO(text, newline=""))]


def _number(value: object) -> str:
    """Return a float as text, whole ones without a point: one missing value makes pandas write 1 as 1.0."""
    number = float(cast(float, value))
    return f"{number:.0f}" if number.is_integer() else repr(number)


def _with_common_names(
    answers: Answers, layout: str | None, choice_codes: Sequence[str], *, with_simulated: bool, keep_na: bool
) -> tuple[Comparisons, dict[str, str] | None]:
    """Return the comparisons, and what stimuli of different groups have in common, which results of sessions know."""
    if _is_table(answers):
        return comparisons(answers, layout, choice_codes, with_simulated=with_simulated, keep_na=keep_na), None
    from analysis.comparisons import grouped_comparisons
    from analysis.report import common_names

    logs = _logs(answers, with_simulated=with_simulated)
    table, groups = grouped_comparisons(logs)
    return table, None if groups is None else common_names(logs[0].header, groups)


def _logs(answers: Answers, *, with_simulated: bool) -> Sequence[SessionLog]:
    """Return the sessions that count together, of answers that are no table."""
    from analysis.records import pool, read_results

    return pool(read_results(cast("str | Path", answers)), with_simulated=with_simulated).sessions


def _counted_together(trials: pd.DataFrame) -> pd.DataFrame:
    """Return trials of people and of simulated observers as those of one kind; a code that both have stays two."""
    if not {"simulated", "observer"} <= set(trials):
        return trials
    made = trials["simulated"].astype(str).str.casefold() == "true"
    shared = made & trials["observer"].isin(trials["observer"][~made])
    codes = trials["observer"].mask(shared, trials["observer"].astype(str) + " (simulated)")
    return trials.drop(columns="simulated").assign(observer=codes)


def _is_table(answers: Answers) -> bool:
    """Return whether ``answers`` are a table of comparisons, not results of sessions.

    Raises
    ------
    InputError
        If they are neither a DataFrame nor a path.
    """
    if isinstance(answers, pd.DataFrame):
        return True
    if isinstance(answers, str | Path):
        path = Path(answers)
        return path.suffix.lower() != ".jsonl" and not path.is_dir()
    what = f"answers of the type {type(answers).__name__} cannot be read"
    remedy = "give a folder of results, a CSV file, or pandas.DataFrame(answers, columns=['winner', 'loser'])"
    if hasattr(answers, "to_pandas"):
        remedy = "give answers.to_pandas()"
    raise InputError(Finding(what, remedy=remedy))
