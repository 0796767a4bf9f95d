"""The Methods section: paragraphs for a paper that describe what was done, with blanks for what nobody recorded."""

from __future__ import annotations

import importlib.metadata
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from statistics import median
from typing import TYPE_CHECKING, Any

from analysis.comparisons.session_comparisons import is_comparison
from analysis.errors import ResultsError
from analysis.kinds.kinds import KINDS
from analysis.kinds.questionnaire import QuestionRecord
from analysis.observers.responses import catch_results
from analysis.records.answered_by import who_answered
from analysis.records.lines import Header
from analysis.records.results import sessions_by_observer
from analysis.records.seen import Seen
from analysis.records.session_record import SessionLog
from analysis.records.times import SessionTimes, duration
from analysis.report.checklist import METHODS_ITEMS, ItemAnswer, Methods, answer
from analysis.report.notes import nominal_words, recorded
from analysis.report.observers import left_out_words
from analysis.report.references import Citations
from analysis.report.seen import NO_EYE, methods_words, white_place
from analysis.report.shown import timing_facts
from analysis.report.statistics import analysis_words, correction_words, draws_words, effect_words, p_words
from analysis.report.words import counted, key_words, listed, plain
from analysis.seals.seal import notes_on_seals
from documents import Finding
from documents.files import unprotected
from documents.pages import Block, Column, Facts, Numbered, Paragraph, Section, Table
from documents.text import did_you_mean

if TYPE_CHECKING:
    from analysis.report.report import Report

_LANGUAGES = {"de": "German", "fr": "French"}


def methods_of(report: Report, given: Mapping[str, str]) -> Methods:
    """Answer every item of the list: from the records and the computation first, then by what people have ``given``.

    Raises
    ------
    ResultsError
        If ``given`` names something that is no item, or that the report computes.
    """
    known = [item.code for item in METHODS_ITEMS if item.may_be_given]
    for code in given:
        if code not in known:
            remedy = did_you_mean(code, known, f"known are {', '.join(known)}")
            raise ResultsError(Finding(f"Methods have no blank '{code}'", remedy=remedy))
    cited = Citations()
    simulated = who_answered(report.sessions).all_simulated
    answers = []
    for item in METHODS_ITEMS:
        said = [_SAID[item.code](report, cited)] if item.code in _SAID else []
        said += [_asked(report.sessions, item.code)] if item.source == "given" else []
        answers.append(answer(item, " ".join(filter(None, said)), given.get(item.code, ""), simulated=simulated))
    return Methods(tuple(answers), cited.works())


def methods_section(methods: Methods, header: Header) -> Section:
    """Return the paragraphs with their blanks and references, the list that they answer, and the header's record."""
    parts: dict[str, list[ItemAnswer]] = {}
    for one in methods.answers:
        parts.setdefault(one.item.part, []).extend([] if one.status == "not_applicable" else [one])
    blocks: list[Block] = [Paragraph(methods.sentence, small=True)] if methods.missing else []
    for own in filter(None, parts.values()):
        blanks = tuple(one.text for one in own if one.status == "missing")
        blocks.append(Paragraph(" ".join(one.text for one in own), blanks=blanks))
    if methods.works:
        blocks.append(Numbered(methods.works))
    blocks += [_checklist(methods), Facts(tuple(_record(header)), folded="The record")]
    return Section("methods", "Methods", tuple(blocks))


_FROM = {
    "recorded": "the records",
    "computed": "the computation",
    "given": "the experiment file",
    "missing": "missing",
    "not_applicable": "does not apply",
}


def _checklist(methods: Methods) -> Table:
    columns = (
        Column("Item", "item"),
        Column("Question", "question"),
        Column("Answered by", "status"),
        Column("Answer", "answer"),
    )
    rows = tuple((one.item.code, one.item.question, _FROM[one.status], one.text) for one in methods.answers)
    return Table("methods", "What journals ask, and what answers it", columns, rows, folded=True)


def _observers(report: Report, cited: Citations) -> str:
    sessions = report.sessions
    observers = dict.fromkeys(session.header.observer for session in sessions)
    who = who_answered(sessions)
    words = f"{counted(len(observers), 'observer')} took part in {counted(len(sessions), 'session')}"
    if who.simulated:
        of_them = "all of them were" if len(observers) > 1 else "the observer was"
        words += f"; {of_them if who.all_simulated else f'{len(who.simulated)} of them were'} simulated"
    return f"{words}."


def _sensitivity(report: Report, cited: Citations) -> str:
    if report.smallest is not None:
        return report.smallest.methods
    return (
        "Which difference so many observers could show was not computed: that is done for pairs that several observers "
        "compare, where the answers do not choose them."
    )


def _exclusions(report: Report, cited: Citations) -> str:
    """Say who was left out and why, and which answers of the others do not count."""
    kept, sessions = report.kept, report.sessions
    parts = [left_out_words(kept)]
    if kept.answers:
        parts.append(f"Answers left out: {', '.join(f'{count:,} of {name}' for name, count in kept.answers.items())}.")
    early = [session for session in sessions if not session.complete]
    if early:
        answers = sum(trial.is_task for session in early for trial in session.trials)
        parts.append(
            f"{counted(len(early), 'session')} ended early; the answers until then are included ({answers:,} of them)."
        )
    trials = [trial for session in sessions for trial in session.trials]
    if practice := sum(trial.is_practice for trial in trials):
        parts.append(f"{counted(practice, 'practice trial')} came first and {_were(practice)} not analysed.")
    caught = catch_results(sessions)
    if caught.obvious or caught.identical.trials:
        parts.append(
            f"{counted(caught.obvious, 'catch trial')} with an obvious answer and {caught.identical.trials} of a "
            "stimulus with itself were included; they are not part of the scores."
        )
    if ties := sum(is_comparison(trial) and trial.is_tie for trial in trials):
        parts.append(f"{counted(ties, 'tie')} {_were(ties)} left out of the scores.")
    if again := sum(len(session.answers) - len(session.trials) for session in sessions):
        parts.append(f"{counted(again, 'answer')} {_were(again)} replaced by a later one to the same trial.")
    return " ".join(parts)


def _were(number: int) -> str:
    return "was" if number == 1 else "were"


def _vision(report: Report, cited: Citations) -> str:
    return " ".join(part.vision for part in report.all_parts if part.vision)


def _asked(sessions: Sequence[SessionLog], name: str) -> str:
    """Say what people answered to the question of a questionnaire that has an item's name; empty if none was asked."""
    answers, questions = [], []
    for own in sessions_by_observer([session for session in sessions if not session.header.simulated]).values():
        asked = [asked for session in own for asked in session.of(QuestionRecord) if asked.name == name]
        questions += [each.question or name for each in asked]
        said = [each for each in asked if each.answer not in (None, "")]
        answers += said[-1:]
    if not answers:
        return ""
    said_by = f"Asked “{questions[0]}”, {counted(len(answers), 'observer')} answered"
    values = [each.answer for each in answers]
    numbers = [value for value in values if isinstance(value, int | float)]
    if len(numbers) == len(values):
        unit = f" {answers[0].unit}" if answers[0].unit else ""
        return f"{said_by}: {min(numbers):g} to {max(numbers):g}{unit}, median {median(numbers):g}."
    if all(each.answered_by == "choice" for each in answers):
        return f"{said_by}: {', '.join(f'{value} ({count})' for value, count in Counter(map(str, values)).items())}."
    return f"{said_by} in their own words (see their answers to questions)."


def _settings_words(settings: Mapping[str, Mapping[str, Any]]) -> str:
    """Say how the monitor was set in the sessions and, where that was stated otherwise, when it was measured."""
    listed = {when: ", ".join(map(_setting, stated, stated.values())) for when, stated in settings.items()}
    words = f" The monitor was set to {listed['used']}." if listed.get("used") else ""
    if listed.get("measured") and listed["measured"] != listed.get("used"):
        which = "it" if listed.get("used") else "the monitor"
        words += f" When {which} was measured it was set to {listed['measured']}."
    return words


def _setting(name: str, value: bool | float | str) -> str:
    """Say one entry of the monitor's menu, such as ``brightness 35 %``."""
    said = f"{value:g}" if isinstance(value, float) else str(value)
    if isinstance(value, bool):
        said = "on" if value else "off"
    words = name.removeprefix("other.").replace("_percent", "").replace(".", " ").replace("_", " ")
    return f"{words} {said}{' %' if '_percent' in name else ''}"


def _display(report: Report, cited: Citations) -> str:
    sessions, header = report.sessions, report.sessions[0].header
    display = header.display
    panel = display.panel
    if not display.file and not panel.given():
        return ""
    words = f"{NO_EYE} " if who_answered(sessions).all_simulated else ""
    words += f"Stimuli were shown on a display described by {display.file or 'an unnamed file'}"
    panel_facts = [f"{' × '.join(map(str, panel.resolution_px))} pixels"] if panel.resolution_px else []
    panel_facts += [f"{panel.pixel_pitch_mm:g} mm pitch"] if panel.pixel_pitch_mm else []
    panel_facts += [f"{panel.refresh_hz:g} Hz"] if panel.refresh_hz else []
    panel_facts += [f"{panel.bits} bits"] if panel.bits else []
    words += f" ({', '.join(panel_facts)})" if panel_facts else ""
    words += f", in the stereo mode {display.mode or 'that was not recorded'}"
    words += f", through {display.glasses} glasses." if display.glasses else "."
    words += _settings_words(display.monitor_settings)
    renderer = header.presentation.renderer
    return f"{words} Frames were drawn by {renderer}." if renderer else words


def _viewing(report: Report, cited: Citations) -> str:
    """Say the viewing distance; where sessions differ, each with their number."""
    distances = Counter(session.header.display.distance_mm for session in report.sessions)
    known = {mm: count for mm, count in distances.items() if mm}
    if not known:
        return ""
    if len(distances) == 1:
        return f"The viewing distance was {next(iter(known)):g} mm."
    each = [f"{mm:g} mm in {counted(count, 'session')}" for mm, count in known.items()]
    each += [f"not recorded in {counted(distances[None], 'session')}"] if distances[None] else []
    return f"The viewing distance was {listed(each)}."


def _room(report: Report, cited: Citations) -> str:
    ambient = report.header.display.ambient_XYZ_cd_m2
    levels = dict.fromkeys(f"{xyz[1]:.3g}" for xyz in (ambient.known if ambient else ()) if any(xyz))
    return f"The room's light on the screen had {' and '.join(levels)} cd/m², part of the white." if levels else ""


def _colours(report: Report, cited: Citations) -> str:
    sessions, display = report.sessions, report.header.display
    if nominal := nominal_words(sessions):
        words = f"The display is nominal, not measured: its colours are those of a standard ({nominal})"
        every = all(session.header.display.nominal for session in sessions)
        return words + ("." if every else ", in some of the sessions; in the others it was measured.")
    if not display.source:
        return ""
    words = (
        f"Colours were reproduced by the display's characterisation in the mode {display.characterised_as} "
        f"({display.source})"
    )
    if display.characterised_as not in (None, display.mode):
        words += f", although the display was not characterised in the mode {display.mode}"
    if white := display.white_XYZ_cd_m2:
        levels = dict.fromkeys(f"{xyz[1]:.4g}" for xyz in white.known)
        words += f", with a white of {' and '.join(levels)} cd/m²{white_place(Seen.of(sessions[0]))}"
    return f"{words}."


def _seen(report: Report, cited: Citations) -> str:
    display, words = report.header.display, []
    crosstalk = display.crosstalk_cancelled
    if crosstalk is not None and display.mode != "flat":
        words.append(f"Crosstalk between the eyes was {'' if crosstalk else 'not '}cancelled.")
    if display.dither not in (None, "none"):
        words.append(f"Codes were dithered ({display.dither}).")
    return " ".join(filter(None, [*words, methods_words(report.sessions, cited)]))


def _timing(report: Report, cited: Citations) -> str:
    if not any(session.header.presentation.timing.given() for session in report.sessions):
        return ""
    facts = dict(timing_facts(report.sessions))
    return f"Swap intervals: {_lower(facts['Swap intervals'])} Onsets: {facts['Onsets']}"


def _stimuli(report: Report, cited: Citations) -> str:
    """Say how many stimuli there were, and how many levels each of their factors has."""
    levels: dict[str, dict[object, None]] = {}
    for factors in report.header.factors.values():
        for name, level in factors.items():
            levels.setdefault(name, {})[level] = None
    words = f"The number of stimuli is {len(report.header.stimuli):,}"
    differ = [f"{key_words(name)} ({len(own)} levels)" for name, own in levels.items() if len(own) > 1]
    return f"{words}; they differ in {listed(differ)}." if differ else f"{words}."


def _task(report: Report, cited: Citations) -> str:
    sessions, header = report.sessions, report.header
    kinds = {trial.kind for session in sessions for trial in session.trials}
    pooled = any(session.pooled for session in sessions)
    answers = "the earlier answers of all observers" if pooled else "earlier answers"
    words = [record.did for kind, record in KINDS.items() if kind in kinds and record.did]
    done = [each.format(stimuli=len(header.stimuli), answers=answers) for each in words]
    parts = [f"Observers {listed(done)}." if done else ""]
    parts.append(f"They were asked: “{header.question}”" if header.question else "")
    parts += [sentence for part in report.all_parts for sentence in part.task]
    return " ".join(filter(None, [*parts, *_interface(header)]))


def _trials(report: Report, cited: Citations) -> str:
    sessions = report.sessions
    parts = _pair_design(sessions)
    for kind, record in sorted(KINDS.items(), key=lambda each: each[1].is_page):
        one, several = record.counted_as
        counts = [sum(trial.kind == kind for trial in session.trials) for session in sessions] if one else []
        if any(counts):
            number = median(count for count in counts if count or record.is_page)
            words = f"{number:,.10g} {one if number == 1 else several}"
            parts.append(
                f"There were {words} in a session (median)." if record.is_page else f"A session has {words} (median)."
            )
    return " ".join(parts) or "The sessions have no trial that is analysed."


def _order(report: Report, cited: Citations) -> str:
    return f"Orders were randomised for each observer (seed {report.header.seed})."


def _sessions(report: Report, cited: Citations) -> str:
    """Say when the sessions began and how long complete ones of people took."""
    days = sorted({str(session.header.started_utc)[:10] for session in report.sessions})
    words = (
        f"The sessions were recorded on {days[0]}"
        if len(days) == 1
        else f"The sessions were recorded from {days[0]} to {days[-1]}"
    )
    lengths = [last for session in report.sessions if (last := _length_s(session))]
    return f"{words}; a complete one took {duration(median(lengths))} (median)." if lengths else f"{words}."


def _length_s(session: SessionLog) -> float | None:
    """Return the seconds to the last answer of a complete session by a person; None of another, or without times."""
    if session.header.simulated or not session.complete or not session.answers:
        return None
    return SessionTimes.of(session).onset_s(session.answers[-1])


def _interface(header: Header) -> list[str]:
    """Say the language of the screens, and what the experiment set of their background and text."""
    parts = []
    language, style = header.interface.language, header.interface.style
    if language != "en":
        parts.append(f"The screens were in {_LANGUAGES.get(language, language)}.")
    for name, stated in (("background", style.background), ("text", style.text)):
        if stated is None:
            continue
        light = []
        if stated.luminance_cd_m2 is not None:
            light.append(f"{stated.luminance_cd_m2:g} cd/m²")
        if stated.share_of_white is not None:
            light.append(f"{100 * stated.share_of_white:g} % of the display's white")
        if stated.xy:
            light.append("chromaticity x = {:g}, y = {:g}".format(*stated.xy))
        if stated.height_arcmin:
            light.append(f"capital letters of {stated.height_arcmin:g} minutes of arc")
        if light:
            parts.append(f"The {name} had {', '.join(light)}.")
    if fonts := [font.name for font in header.interface.fonts]:
        parts.append(f"Words were set in DejaVu Sans and {', '.join(fonts)}.")
    return parts


def _pair_design(sessions: Sequence[SessionLog]) -> list[str]:
    compared = [[trial for trial in session.trials if is_comparison(trial)] for session in sessions]
    compared = [trials for trials in compared if trials]
    if not compared:
        return []
    times: Counter[int] = Counter()
    for trials in compared:
        counts = Counter(frozenset((t.first, t.second)) for t in trials)
        times.update(counts.values())
    parts = [f"A session has {counted(median(len(trials) for trials in compared), 'comparison')} (median)"]
    parts[0] += (
        f", each pair {'once' if times.most_common(1)[0][0] == 1 else f'{times.most_common(1)[0][0]} times'}."
        if len(times) == 1
        else "."
    )
    places = list(dict.fromkeys(t.first_position for ts in compared for t in ts if t.first_position))
    if any(place.startswith("interval") for place in places):
        parts.append("The two stimuli of a pair were shown one after the other.")
    elif places:
        parts.append(f"The first stimulus of a pair was at the {listed(places)}.")
    return parts


def _software(report: Report, cited: Citations) -> str:
    """Say with what the sessions were run, in each version, and with what the report was computed."""
    run = dict.fromkeys(filter(None, (_versions(each) for session in report.sessions for each in session.software)))
    here = {name: importlib.metadata.version(name) for name in ("cyclopean", "numpy", "scipy")}
    made = f"The report was computed with {_versions(here)}."
    if resumed := sum(len(session.software) > 1 for session in report.sessions):
        made = f"Versions changed within {counted(resumed, 'session')}, on resuming. {made}"
    return f"Sessions were run with {'; others with '.join(run)}. {made}" if run else made


def _versions(software: Mapping[str, Any]) -> str:
    words = listed(f"{name} {value}" for name, value in software.items() if name not in ("commit", "system"))
    return f"{words} (commit {software['commit']})" if words and software.get("commit") else words


def _records(report: Report, cited: Citations) -> str:
    """Say how many logs have checksums, which fit where a report is made, what is not protected, and the seal."""
    firsts = [session.chained_from for session in recorded(report.sessions)]
    if not firsts:
        return ""
    chained = sum(first is not None for first in firsts)
    fits = f"Each line of {counted(chained, 'log')} is chained to the line before by SHA-256, and every checksum fits."
    seals = list(notes_on_seals(report.sessions)) or ["The results are not sealed."]
    return " ".join([*([fits] if chained else []), *(f"{sentence}." for sentence in unprotected(firsts)), *seals])


_SAID: Mapping[str, Callable[[Report, Citations], str]] = {
    "observers": _observers,
    "vision": _vision,
    "sensitivity": _sensitivity,
    "exclusions": _exclusions,
    "display": _display,
    "viewing": _viewing,
    "room": _room,
    "colours": _colours,
    "seen": _seen,
    "timing": _timing,
    "stimuli": _stimuli,
    "task": _task,
    "trials": _trials,
    "order": _order,
    "sessions": _sessions,
    "analysis": analysis_words,
    "draws": draws_words,
    "p_values": p_words,
    "correction": correction_words,
    "effect_sizes": effect_words,
    "software": _software,
    "records": _records,
}


def _record(header: Header) -> list[tuple[str, str]]:
    rows = [(f"Display {key_words(name)}", plain(value)) for name, value in header.display.given().items()]
    rows += [(f"Presentation {key_words(name)}", plain(value)) for name, value in header.presentation.given().items()]
    rows.append(("Analysis", plain(header.analysis.given())))
    rows.append(("Seed", str(header.seed)))
    rows.append(("Software", ", ".join(f"{name} {value}" for name, value in header.software.items()) or "–"))
    return rows + [(f"SHA-256 of the {key_words(name)}", str(value)) for name, value in header.hashes.items()]


def _lower(words: str) -> str:
    return words[:1].lower() + words[1:]
