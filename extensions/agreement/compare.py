"""From the results of an experiment to measures of its pictures beside what observers said."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np

from analysis.comparisons import factors_of
from analysis.errors import ResultsError
from analysis.observers import keep
from analysis.records import Header, SessionLog, read_results, what_eyes_saw, who_answered
from documents import Finding, WorkError, did_you_mean
from documents.files import writing
from documents.options import Typed
from documents.pages import Block
from documents.text import JsonResult
from extensions.agreement.comparison import agree
from extensions.agreement.gather import observed_groups
from extensions.agreement.observed import ObservedGroup
from extensions.agreement.options import AgreementOptions
from extensions.agreement.page import agreement_blocks, write_agreement_csv, write_agreement_page
from extensions.agreement.result import Agreement, Predicted
from extensions.agreement.shown import ShownPictures, shown_pictures
from runner.reports import check_page
from runner.session import Progress
from stimuli.measures import MeasureRow, measures_named, package_of

# The limit of `cyclopean compare` for car paint, thesis Section 5.5.
LIMITS: Mapping[str, float] = {"delta-e-2000": 1.4}
MOST_LISTED, MOST_NAMED = 5, 8
Factors = Mapping[str, Mapping[str, str]]


@dataclass(frozen=True, slots=True, eq=False)
class WrittenAgreement(JsonResult):
    """The results, the ``header`` of a session, and ``facts`` on the pictures: pairs of a term and its value.

    ``page`` and ``csv_folder`` were written, if they were asked for.
    """

    agreement: Agreement
    header: Header
    facts: tuple[tuple[str, str], ...]
    page: Path | None = None
    csv_folder: Path | None = None
    json_keys: ClassVar = {"agreement": "*"}
    json_names: ClassVar = "header.experiment header.question pictures agreement"

    @property
    def pictures(self) -> dict[str, str]:
        """The facts on the pictures by their terms."""
        return dict(self.facts)

    def told(self) -> Iterator[str | Block]:
        """Yield the results, and what was written."""
        yield from agreement_blocks(self.agreement)
        files = (("The page", self.page), ("Its tables", self.csv_folder))
        yield from (f"{what}: {file}" for what, file in files if file is not None)


def compare_with_observers(
    results: Annotated[Sequence[Path], Typed(metavar="RESULTS...")],
    measures: Annotated[Sequence[str], Typed("--measures", "NAME,...", read="documents.options.names_of")],
    options: AgreementOptions | None = None,
    progress: Progress = lambda what, done, of: None,
) -> WrittenAgreement:
    """Compare measures of an experiment's pictures with its observers.

    RESULTS are folders of sessions of one experiment. Every stimulus is measured beside its photograph, as the display
    showed both and from the distance in the record. Reported are correlations with observers' scores, how many of the
    pairs that observers tell apart the measure puts in order, and what a limit says of the photograph's class.

    Parameters
    ----------
    results
        Folders of sessions, from one station or many, or single session logs.
    measures
        Measures of pictures, such as delta-e-2000,flip; all for those that are installed.
    options
        Which stimuli are the photographs, the measures' limits, and what to write.
    progress
        Called with what is being done, how much of it is done, and of how much.

    Returns
    -------
    WrittenAgreement
        Correlations, accuracy on pairs, and limits against classes, for each measure.

    Raises
    ------
    InputError
        If results are missing, damaged or of several experiments, the pictures are not those that were shown, no
        stimulus is known to be the photograph, a measure is unknown or not installed, or a group has fewer than three
        stimuli. Nothing is then written.
    WorkError
        If the page or a table cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from runner.session import simulate
    >>> experiment, observers = "experiments/dynamic_range.yaml", "configs/observers/table_4_4.yaml"
    >>> with TemporaryDirectory() as folder:
    ...     simulated = simulate(experiment, observers, 5, results=folder)
    ...     found = compare_with_observers(
    ...         [Path(folder)], ["delta-e-2000"], AgreementOptions(photographs=("2.1-stereo",))
    ...     )
    >>> found.agreement.photographs, found.agreement.groups[0].observers
    (('2.1-stereo',), 5)
    """
    options = options or AgreementOptions()
    chosen = measures_named(measures)
    _check_limits(options.limits, [measure.name for measure in chosen])
    if options.page is not None:
        check_page(options.page, ())
    kept = keep(read_results(*results), options.rule)
    sessions = kept.sessions
    found, notes = observed_groups(sessions, task=options.task, alpha=options.alpha, adjust=options.adjust)
    header = sessions[0].header
    shown = shown_pictures(sessions, options.experiment, results[0])
    reference = shown.experiment.stimuli.reference
    groups, photographs = _photographs(found, factors_of(header), reference, options.photographs)
    predicted = _predict(shown, groups, photographs, [one.name for one in chosen], options.limits, progress)
    level = options.alpha if options.alpha is not None else header.analysis.alpha
    notes = (*kept.notes, *_session_notes(sessions), *notes, *_mixed(shown, groups, photographs))
    agreement = agree(groups, photographs, predicted, alpha=level, notes=notes)
    written = WrittenAgreement(agreement, header, _facts(shown, agreement), options.page, options.csv_folder)
    with writing(options.page or results[0], "comparison", WorkError):
        if options.page is not None:
            write_agreement_page(agreement, header, options.page, written.facts)
        if options.csv_folder is not None:
            write_agreement_csv(agreement, options.csv_folder)
    return written


def _check_limits(limits: Mapping[str, float], names: Sequence[str]) -> None:
    for name, limit in limits.items():
        if name not in names:
            remedy = did_you_mean(name, names, f"the measures are: {', '.join(names)}")
            raise ResultsError(Finding(f"a limit is given for '{name}', which is not measured", remedy=remedy))
        if not np.isfinite(limit):
            raise ResultsError(Finding(f"the limit of '{name}' is {limit}", remedy="give a finite number"))


def _predict(
    shown: ShownPictures,
    groups: Sequence[ObservedGroup],
    photographs: Sequence[str],
    names: Sequence[str],
    limits: Mapping[str, float],
    progress: Callable[[str, int, int], None],
) -> tuple[Predicted, ...]:
    """Measure every stimulus beside its photograph, once."""
    wanted = list(
        dict.fromkeys(
            (photograph, stimulus)
            for group, photograph in zip(groups, photographs, strict=True)
            for stimulus in group.stimuli
            if stimulus != photograph
        )
    )
    rows: dict[tuple[str, str], Mapping[str, MeasureRow]] = {}
    for done, (photograph, stimulus) in enumerate(wanted):
        progress("Measuring pictures", done, len(wanted))
        rows[photograph, stimulus] = shown.measured(photograph, stimulus, names)
    progress("Measuring pictures", len(wanted), len(wanted))
    return tuple(_of_measure(name, rows, groups, photographs, limits) for name in names)


def _of_measure(
    name: str,
    rows: Mapping[tuple[str, str], Mapping[str, MeasureRow]],
    groups: Sequence[ObservedGroup],
    photographs: Sequence[str],
    limits: Mapping[str, float],
) -> Predicted:
    (measure,) = measures_named([name])

    def value(photograph: str, stimulus: str) -> float:
        if stimulus == photograph:
            return measure.identical
        row = rows[photograph, stimulus][name]
        return float(row.eyes["both"].value if row.binocular is None else row.binocular)

    return Predicted(
        name=name,
        title=measure.title,
        unit=measure.unit,
        better=measure.better,
        values=tuple(
            np.array([value(photograph, stimulus) for stimulus in group.stimuli])
            for group, photograph in zip(groups, photographs, strict=True)
        ),
        limit=limits.get(name, LIMITS.get(name)),
        remarks=(*_remarks(name, rows), *package_of(name)),
    )


def _remarks(name: str, rows: Mapping[tuple[str, str], Mapping[str, MeasureRow]]) -> tuple[str, ...]:
    """Return a remark of a measure on one of the pictures, and of how many it has others."""
    remarked = {
        stimulus: remark
        for (_, stimulus), row in rows.items()
        for eye in row[name].eyes.values()
        for remark in eye.remarks[:1]
    }
    if not remarked:
        return ()
    stimulus, remark = next(iter(remarked.items()))
    if set(remarked.values()) == {remark}:
        return (remark,)
    more = f"; so for {len(remarked)} of {len(rows)} stimuli" if len(remarked) > 1 else ""
    return (f"'{stimulus}': {remark}{more}",)


def _mixed(shown: ShownPictures, groups: Sequence[ObservedGroup], photographs: Sequence[str]) -> list[str]:
    mixed = dict.fromkeys(
        name
        for group, photograph in zip(groups, photographs, strict=True)
        for name in shown.mixed(photograph, group.stimuli)
    )
    if not mixed:
        return []
    some = ", ".join(list(mixed)[:MOST_LISTED]) + (
        f" and {len(mixed) - MOST_LISTED} more" if len(mixed) > MOST_LISTED else ""
    )
    return [
        f"Of photograph and stimulus, one was in stereo and the other flat: {some}. Each eye's picture is measured; "
        "depth, which observers see, is in no measure of single eyes."
    ]


def _session_notes(sessions: Sequence[SessionLog]) -> list[str]:
    notes = []
    who = who_answered(sessions)
    if who.simulated:
        notes.append("Observers are simulated." if who.all_simulated else f"There are {who.words()}.")
    unfinished = sum(not session.complete for session in sessions)
    if unfinished:
        notes.append(f"{unfinished} of {len(sessions)} sessions were not completed; their answers count.")
    otherwise = dict.fromkeys(seen.otherwise for seen in what_eyes_saw(sessions) if seen.otherwise)
    notes += [f"Each eye saw {what}. Measured is its view by itself, not what it saw." for what in otherwise]
    if sessions[0].header.display.nominal:
        notes.append("The display was not measured: luminances and colours of the pictures are nominal.")
    return notes


def _facts(shown: ShownPictures, agreement: Agreement) -> tuple[tuple[str, str], ...]:
    viewing = shown.viewing
    white = " ".join(f"{part:.4g}" for part in viewing.white_XYZ)
    return (
        ("Photographs", ", ".join(dict.fromkeys(agreement.photographs))),
        ("Pictures", "each eye's view by itself: the part that the layout shows, clipped to the display's gamut"),
        ("SHA-256 of the stimuli", shown.stimuli.digest),
        ("Viewing distance", f"{viewing.distance_mm:g} mm, by the record of the sessions"),
        ("Pixels per degree", f"{viewing.pixels_per_degree:.4g}"),
        ("White of the display", f"XYZ {white} cd/m²"),
    )


def _photographs(
    groups: Sequence[ObservedGroup], factors: Factors, reference: str | None, named: Sequence[str]
) -> tuple[tuple[ObservedGroup, ...], tuple[str, ...]]:
    """Return the groups, divided where their stimuli have several photographs, and the photograph of each.

    Parameters
    ----------
    groups
        What observers said.
    factors
        Each stimulus's factors, their levels as words.
    reference
        The experiment's reference picture; None if it shows none.
    named
        Names of photographs, or ``FACTOR=LEVEL`` for the stimuli with that level; they come before the reference.

    Raises
    ------
    ResultsError
        If nothing says which stimulus is the photograph, a name is no stimulus, or a group has several or none.
    """
    photographs = _named(factors, named) if named else [reference] if reference is not None else []
    if not photographs:
        some = ", ".join(list(factors)[:MOST_NAMED]) + (", …" if len(factors) > MOST_NAMED else "")
        what = "no stimulus is known to be the photograph that the others are measured against: none was shown as such"
        remedy = f"name it: --photograph STIMULUS, one of {some}; or one for each group: --photograph FACTOR=LEVEL"
        raise ResultsError(Finding(what, remedy=remedy))
    found = [pair for group in groups for pair in _divided(group, photographs, factors)]
    return tuple(group for group, _ in found), tuple(photograph for _, photograph in found)


def _named(factors: Factors, named: Sequence[str]) -> list[str]:
    photographs: dict[str, None] = {}
    for name in named:
        factor, equals, level = name.partition("=")
        if name in factors:
            photographs[name] = None
        elif equals:
            chosen = [stimulus for stimulus, own in factors.items() if own.get(factor) == level]
            if not chosen:
                known = sorted({f"{key}={own[key]}" for own in factors.values() for key in own})
                what = f"no stimulus has {factor} '{level}'"
                raise ResultsError(Finding(what, remedy=did_you_mean(name, known)))
            photographs |= dict.fromkeys(chosen)
        else:
            raise ResultsError(Finding(f"there is no stimulus '{name}'", remedy=did_you_mean(name, list(factors))))
    return list(photographs)


def _divided(group: ObservedGroup, photographs: Sequence[str], factors: Factors) -> list[tuple[ObservedGroup, str]]:
    """Return a group with its photograph, or its parts with theirs."""
    if len(photographs) == 1:
        return [(group, photographs[0])]
    own = [name for name in photographs if name in group.stimuli]
    if len(own) == 1:
        return [(group, own[0])]
    # Of stimuli on one scale or beside the scale, each goes with the photograph whose level of a factor it shares.
    candidates = own or list(photographs)
    for factor in _telling(candidates, factors):
        of_level = {factors[name][factor]: name for name in candidates}
        parts = [
            (level, [stimulus for stimulus in group.stimuli if factors[stimulus].get(factor) == level])
            for level in of_level
        ]
        if sum(len(stimuli) for _, stimuli in parts) == len(group.stimuli):
            return [
                (group.only(stimuli, group.name if len(stimuli) == len(group.stimuli) else level), of_level[level])
                for level, stimuli in parts
                if stimuli
            ]
    several = ", ".join(candidates[:MOST_NAMED])
    which = f"the group '{group.name}'" if group.name else "the stimuli"
    what = f"{which} may be measured against {len(candidates)} photographs: {several}"
    remedy = "name one, or give the stimuli a factor, such as scene, that each shares with its photograph"
    raise ResultsError(Finding(what, remedy=remedy))


def _telling(photographs: Sequence[str], factors: Factors) -> list[str]:
    """Return the factors that all photographs have, each another level."""
    first = factors[photographs[0]]
    return [
        key
        for key in first
        if all(key in factors[name] for name in photographs)
        and len({factors[name][key] for name in photographs}) == len(photographs)
    ]
