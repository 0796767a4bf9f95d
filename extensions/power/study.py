"""The power of an experiment: its design, the scores assumed, and studies simulated with them."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

from analysis.errors import ResultsError
from analysis.simulation import Plan
from documents import Finding, WorkError
from documents.files import writing
from documents.pages import Block
from documents.text import JsonResult
from extensions.power.assumed import ObserverSpread, assume, observer_spread_of
from extensions.power.groups import GroupsNeeded
from extensions.power.options import PowerOptions
from extensions.power.page import assumed_notes, write_page
from extensions.power.results import Needed, check_target, chosen_pairs, observers_needed
from extensions.power.simulated import simulate_power
from extensions.power.tables import power_blocks, write_csv
from runner.protocol import read_experiment
from runner.reports import PairDesign, pair_design


@dataclass(frozen=True, slots=True, eq=False)
class PowerStudy(JsonResult):
    """The power of an ``experiment``: how many observers it needs, and ``notes`` that come before the numbers.

    Attributes
    ----------
    observers
        How much observers were taken to differ, and why.
    by_observer_sd
        Standard deviations between observers, and what is needed with each; empty where it was given.
    page, table
        The page and the table that were asked for; a dash is the terminal.
    """

    experiment: str
    needed: Needed | GroupsNeeded
    notes: tuple[str, ...]
    observers: ObserverSpread
    by_observer_sd: tuple[tuple[float, Needed | GroupsNeeded], ...]
    page: Path | None = None
    table: Path | None = None
    json_keys: ClassVar = {"observers": "observer_spread", "compared": "by_observer_sd", "needed.details": "*"}
    json_names: ClassVar = "experiment notes observers compared needed needed.details"

    def told(self) -> Iterator[str | Block]:
        """Yield the answer and its notes, or the table where it goes to the terminal."""
        if str(self.table) == "-":
            stream = io.StringIO(newline="")
            write_csv(self.needed, stream)
            yield stream.getvalue().replace("\r\n", "\n").removesuffix("\n")
            return
        yield from power_blocks(self.needed)
        yield from self.notes
        if self.page is not None:
            yield f"The page: {self.page}"

    @property
    def compared(self) -> list[dict[str, Any]]:
        """What is needed with each standard deviation between observers."""
        answers = self.by_observer_sd
        return [{"observer_sd": sd, "observers": of.observers, "sentence": of.sentence} for sd, of in answers]


def study_power(
    experiment: Path,
    options: PowerOptions,
    progress: Callable[[int, int], None] | None = None,
    note: Callable[[str], None] | None = None,
) -> PowerStudy:
    """Simulate studies of an experiment with several numbers of observers.

    Parameters
    ----------
    experiment
        An experiment file with a block of all pairs; its stimuli need not be built.
    options
        What is assumed, and how studies are simulated and tested.
    progress
        Called with how many blocks of work are done, and how many there are.
    note
        Called with a sentence if processes could not be started.

    Returns
    -------
    The number of observers needed, with the power of each number tried.

    Raises
    ------
    InputError
        If a file is wrong, the experiment compares no pairs of a fixed number, or an option is out of range.
    WorkError
        If blocks of work cannot be computed, or a file cannot be written.

    Examples
    --------
    >>> options = PowerOptions(observers=(10, 40), replicates=100, workers=1)
    >>> study = study_power(Path("experiments/dynamic_range.yaml"), options)
    >>> study.needed.observers, study.needed.power.separates.shape
    (None, (2, 45))
    """
    _refuse_together(options)
    design = read_experiment(experiment)
    pairs = pair_design(design)
    assumed = assume(
        pairs,
        scores=options.scores,
        simulate=options.simulate,
        spread_nats=options.spread_nats,
        with_simulated=options.with_simulated,
        keep_na=options.keep_na,
    )
    observers = observer_spread_of(
        options.observer_sd,
        options.observers_from,
        assumed.spread,
        with_simulated=options.with_simulated,
        keep_na=options.keep_na,
    )
    check_target(options.target)  # before the work, not after it
    chosen_pairs(pairs.items, options.pairs)
    plan = Plan(
        items=pairs.items,
        theta=assumed.theta,
        times=pairs.times,
        differs=assumed.differs,
        observer_sd=observers.sd,
        scores_of=assumed.scores_of,
        lapse_rate=assumed.lapse_rate if options.lapse_rate is None else options.lapse_rate,
        alpha=design.spec.analysis.alpha if options.alpha is None else options.alpha,
        adjust=options.adjust or design.spec.analysis.adjust,
        covariance=options.covariance or design.spec.analysis.covariance,
        interval=options.interval,
    )
    parts, left_out = _parts(plan, pairs, options.pairs)
    spreads = (observers.sd, *observers.others)
    answers: list[Needed | GroupsNeeded] = []
    for number, sd in enumerate(spreads):
        replicates = min(options.replicates, MOST_TO_COMPARE) if number else options.replicates
        each = []
        for place, (name, own, matter) in enumerate(parts):
            power = simulate_power(
                replace(own, observer_sd=sd),
                options.observers,
                replicates=replicates,
                seed=options.seed + place,
                scheduler=options.scheduler,
                workers=options.workers,
                note=note,
                done=None
                if progress is None
                else _part(progress, number * len(parts) + place, len(spreads) * len(parts)),
            )
            each.append((name, observers_needed(power, matter, options.target)))
        answers.append(GroupsNeeded(tuple(each)) if pairs.groups else each[0][1])
    needed = answers[0]
    places = sorted(range(len(spreads)), key=spreads.__getitem__)
    by_sd = tuple((spreads[place], answers[place]) for place in places) if observers.others else ()
    notes = (*assumed.notes, *observers.notes, *_compared(by_sd, options.observers), *left_out, *assumed_notes(plan))
    study = PowerStudy(design.spec.name, needed, notes, observers, by_sd, options.page, options.table)
    if options.page is not None:
        with writing(options.page, "page", WorkError):
            write_page(needed, options.page, study.experiment, notes)
    if options.table is not None and str(options.table) != "-":
        with writing(options.table, "table", WorkError):
            write_csv(needed, options.table)
    return study


def _refuse_together(options: PowerOptions) -> None:
    """Raise ResultsError if options were given that do not go together."""
    for names in (
        ("scores", "simulate", "spread_nats"),
        ("observer_sd", "observers_from"),
        ("scheduler", "workers"),
    ):
        given = [name for name in names if getattr(options, name) is not None]
        if len(given) > 1:
            raise ResultsError(Finding(f"{' and '.join(given)} do not go together", remedy="give one of them"))


Pairs = tuple[tuple[str, str], ...]


def _parts(plan: Plan, pairs: PairDesign, named: Pairs) -> tuple[list[tuple[str, Plan, Pairs]], tuple[str, ...]]:
    """Return each group's name, plan, and pairs that matter, and notes on groups that are left out.

    A group is left out where no pair of it is named although others are, or no pair of it should differ.

    Raises
    ------
    ResultsError
        If a pair is named whose items are never on one scale.
    """
    if not pairs.groups:
        return [("", plan, named)], ()
    group_of = {pairs.items[item]: name for name, members in pairs.groups for item in members}
    for one, other in named:
        if group_of[one] != group_of[other]:
            what = f"{one} and {other} are in different groups, '{group_of[one]}' and '{group_of[other]}'"
            raise ResultsError(Finding(what, remedy="name pairs of one group, or link the groups with 'across'"))
    parts, without = [], []
    for name, members in pairs.groups:
        place, within = list(members), pairs.pairs_within(members)
        own = replace(
            plan,
            items=tuple(plan.items[item] for item in place),
            theta=plan.theta[place] - plan.theta[place].mean(),
            times=plan.times[..., within],
            differs=plan.differs[within],
        )
        matter = tuple(pair for pair in named if group_of[pair[0]] == name)
        if matter or (not named and own.differs.any()):
            parts.append((name, own, matter))
        else:
            without.append(name)
    if not parts:
        raise ResultsError(Finding("no two items should differ", remedy="name the pairs that matter with --pair"))
    why = "no pair of theirs is named" if named else "their stimuli are assumed to be equal"
    return parts, (f"Groups left out, since {why}: {', '.join(without)}.",) if without else ()


MOST_TO_COMPARE = 400  # studies of each number of observers, where only the number needed is reported


def _part(progress: Callable[[int, int], None], number: int, of: int) -> Callable[[int, int], None]:
    """Report the progress of one of several simulations in per cent of all."""
    return lambda done, blocks: progress(round(100 * (number + done / blocks) / of), 100)


def _compared(answers: Sequence[tuple[float, Needed | GroupsNeeded]], sizes: Sequence[int]) -> tuple[str, ...]:
    """Return a sentence on how many observers are needed if they differ less or more."""
    if not answers:
        return ()
    parts = []
    for sd, needed in answers:
        number = f"more than {max(sizes)}" if needed.observers is None else str(needed.observers)
        parts.append(f"{number} at {sd:.2g} nats" if sd else f"{number} if they do not differ")
    return (f"Observers needed, by how much they differ: {', '.join(parts)}.",)
