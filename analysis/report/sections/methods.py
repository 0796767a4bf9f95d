"""The Methods section: paragraphs for a paper that describe what was done."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from statistics import median
from typing import Any

from analysis.comparisons.session_comparisons import is_comparison
from analysis.observers.filters import Kept
from analysis.observers.responses import catch_results
from analysis.ratings.ratings import RatingSummary
from analysis.records.answered_by import who_answered
from analysis.records.seen import Seen
from analysis.records.session_record import Header, SessionLog
from analysis.report.blocks import Block, Facts, Numbered, Paragraph, Section
from analysis.report.grouped import GroupedSummary
from analysis.report.notes import nominal_words, recorded
from analysis.report.references import Citations
from analysis.report.sections.observers import left_out_words, screening_words
from analysis.report.sections.seen import NO_EYE, methods_words, white_place
from analysis.report.sections.series import weighting
from analysis.report.sections.shown import timing_facts
from analysis.report.summary import Answered, Summary
from analysis.report.words import counted, fixed, key_words, listed, plain
from analysis.series.summary import SeriesSummary
from documents.files import unprotected

_POOLED = {
    "active_pairs": "compared pairs of {stimuli} stimuli that were chosen by the earlier answers of all observers",
}
_DESIGNS = {
    "all_pairs": "compared pairs of {stimuli} stimuli",
    "active_pairs": "compared pairs of {stimuli} stimuli that were chosen by earlier answers",
    "best_of_series": "chose one picture from each series",
    "rating": "rated single stimuli",
    "preference": "chose between the stereo and the flat version of pictures",
    "threshold": "detected stimuli at levels that were chosen by earlier answers",
}

_LANGUAGES = {"de": "German", "fr": "French"}


def methods_section(
    sessions: Sequence[SessionLog],
    kept: Kept | None,
    compared: Summary | GroupedSummary | None,
    adjustment: str,
    *,
    series: SeriesSummary | None,
    ratings: RatingSummary | None,
    preferences: bool,
    thresholds: bool,
    factors: bool,
    observers: bool,
) -> Section:
    """Return the paragraphs, their references, and the records in the sessions' headers."""
    cited = Citations()
    header = sessions[0].header
    paragraphs = [
        _people(sessions, kept),
        _display(sessions, cited),
        _design(sessions, ratings),
        _compared(compared, adjustment, cited) if compared else "",
        _others(cited, series=series, ratings=ratings, preferences=preferences, factors=factors, observers=observers),
        _thresholds(sessions, cited) if thresholds else "",
        _software(header),
        _protection(sessions),
    ]
    blocks: list[Block] = [Paragraph(text) for text in paragraphs if text]
    if cited.keys:
        blocks.append(Numbered(cited.works()))
    return Section("methods", "Methods", (*blocks, Facts(tuple(_record(header)), folded="The record")))


def _people(sessions: Sequence[SessionLog], kept: Kept | None) -> str:
    observers = dict.fromkeys(session.header.observer for session in sessions)
    who = who_answered(sessions)
    words = f"{counted(len(observers), 'observer')} took part in {counted(len(sessions), 'session')}"
    if who.simulated:
        of_them = "all of them were" if len(observers) > 1 else "the observer was"
        words += f"; {of_them if who.all_simulated else f'{len(who.simulated)} of them were'} simulated"
    incomplete = sum(not session.complete for session in sessions)
    if incomplete:
        words += f"; {counted(incomplete, 'session')} ended early; the answers until then are included"
    return " ".join(filter(None, (f"{words}.", screening_words(sessions), left_out_words(kept))))


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


def _display(sessions: Sequence[SessionLog], cited: Citations) -> str:
    header = sessions[0].header
    display = header.display
    panel = display.get("panel") or {}
    words = f"{NO_EYE} " if who_answered(sessions).all_simulated else ""
    words += f"Stimuli were shown on a display described by {display.get('file', 'an unnamed file')}"
    panel_facts = (
        [f"{' × '.join(str(side) for side in panel['resolution_px'])} pixels"] if panel.get("resolution_px") else []
    )
    if panel.get("pixel_pitch_mm"):
        panel_facts.append(f"{panel['pixel_pitch_mm']:g} mm pitch")
    if panel.get("refresh_hz"):
        panel_facts.append(f"{panel['refresh_hz']:g} Hz")
    if panel.get("bits"):
        panel_facts.append(f"{panel['bits']} bits")
    words += f" ({', '.join(panel_facts)})" if panel_facts else ""
    words += f", in the stereo mode {display.get('mode', 'that was not recorded')}"
    if display.get("glasses"):
        words += f", through {display['glasses']} glasses"
    if display.get("distance_mm"):
        words += f", at a distance of {display['distance_mm']:g} mm"
    words += "."
    words += _settings_words(display.get("monitor_settings") or {})
    if nominal := nominal_words(sessions):
        words += f" The display is nominal, not measured: its colours are those of a standard ({nominal})"
        every = all(session.header.nominal for session in sessions)
        words += "." if every else ", in some of the sessions; in the others it was measured."
    elif display.get("source"):
        words += (
            f" Colours were reproduced by the display's characterisation in the mode {display.get('characterised_as')} "
            f"({display['source']})"
        )
        if display.get("characterised_as", display.get("mode")) != display.get("mode"):
            words += f", although the display was not characterised in the mode {display.get('mode')}"
        white = display.get("white_XYZ_cd_m2") or {}
        if white:
            levels = dict.fromkeys(f"{float(xyz[1]):.4g}" for xyz in white.values())
            words += f", with a white of {' and '.join(levels)} cd/m²{white_place(Seen.of(sessions[0]))}"
        room = [float(xyz[1]) for xyz in (display.get("ambient_XYZ_cd_m2") or {}).values()]
        if any(room):
            levels = dict.fromkeys(f"{luminance:.3g}" for luminance in room)
            words += f", {' and '.join(levels)} cd/m² of it the room's light on the screen"
        words += "."
    crosstalk = display.get("crosstalk_cancelled")
    if crosstalk is not None and display.get("mode") != "flat":
        words += f" Crosstalk between the eyes was {'' if crosstalk else 'not '}cancelled."
    if display.get("dither", "none") != "none":
        words += f" Codes were dithered ({display['dither']})."
    if said := methods_words(sessions, cited):
        words += f" {said}"
    renderer = header.presentation.get("renderer")
    if renderer:
        words += f" Frames were drawn by {renderer}."
    facts = dict(timing_facts(sessions))
    words += f" Swap intervals: {_lower(facts['Swap intervals'])} Onsets: {facts['Onsets']}"
    return words


def _design(sessions: Sequence[SessionLog], ratings: RatingSummary | None) -> str:
    header = sessions[0].header
    kinds = list(dict.fromkeys(trial.kind for session in sessions for trial in session.trials))
    stimuli = len(header.stimuli)
    designs = _DESIGNS | (_POOLED if any(session.pooled for session in sessions) else {})
    done = [words.format(stimuli=stimuli) for kind, words in designs.items() if kind in kinds]
    parts = [f"Observers {listed(done)}." if done else ""]
    parts.append(f"They were asked: “{header.question}”" if header.question else "")
    parts += [*_interface(header), *_pair_design(sessions)]
    for kind, noun in (
        ("best_of_series", "choice"),
        ("rating", "stimulus rated"),
        ("preference", "preference"),
        ("threshold", "trial at a threshold"),
    ):
        counts = [sum(trial.kind == kind for trial in session.trials) for session in sessions]
        if any(counts):
            number = median(count for count in counts if count)
            plural = {"stimulus rated": "rating screens", "trial at a threshold": "trials at thresholds"}
            words = f"{number:,.10g} {plural[noun]}" if noun in plural and number != 1 else counted(number, noun)
            parts.append(f"A session has {words} (median).")
    parts += [f"After the choice between two, {what} rated on {scales}." for what, scales in _after_choices(ratings)]
    caught = catch_results(sessions)
    if caught.obvious or caught.identical:
        parts.append(
            f"{counted(caught.obvious, 'catch trial')} with an obvious answer and {caught.identical} of a stimulus "
            "with itself were included; they are not part of the scores."
        )
    if "practice" in kinds:
        parts.append("Practice trials came first and were not analysed.")
    breaks = [sum(trial.kind == "break" for trial in session.trials) for session in sessions]
    if any(breaks):
        parts.append(f"There were {counted(median(breaks), 'break')} in a session (median).")
    parts.append(f"Orders were randomised for each observer (seed {header.seed}).")
    return " ".join(part for part in parts if part)


def _after_choices(ratings: RatingSummary | None) -> Iterator[tuple[str, str]]:
    """Yield what was rated after choices between two stimuli, and on what."""
    for of, what in (("chosen", "the stimulus chosen was"), ("both", "both stimuli were")):
        scales = [scale.scale for scale in (ratings.scales if ratings else ()) if scale.of == of]
        if scales:
            yield what, f"the {'scale' if len(scales) == 1 else 'scales'} {listed(scales)}"


def _interface(header: Header) -> list[str]:
    """Say the language of the screens, and what the experiment set of their background and text."""
    parts = []
    language = header.interface.get("language", "en")
    if language != "en":
        parts.append(f"The screens were in {_LANGUAGES.get(language, language)}.")
    style = header.interface.get("style") or {}
    for name in ("background", "text"):
        stated = style.get(name) or {}
        light = []
        if stated.get("luminance_cd_m2") is not None:
            light.append(f"{stated['luminance_cd_m2']:g} cd/m²")
        if stated.get("share_of_white") is not None:
            light.append(f"{100 * stated['share_of_white']:g} % of the display's white")
        if stated.get("xy"):
            light.append("chromaticity x = {:g}, y = {:g}".format(*stated["xy"]))
        if stated.get("height_arcmin"):
            light.append(f"capital letters of {stated['height_arcmin']:g} minutes of arc")
        if light:
            parts.append(f"The {name} had {', '.join(light)}.")
    if fonts := [str(font.get("name")) for font in header.interface.get("fonts") or ()]:
        parts.append(f"Words were set in DejaVu Sans and {', '.join(fonts)}.")
    return parts


def _pair_design(sessions: Sequence[SessionLog]) -> list[str]:
    compared = [[trial for trial in session.trials if is_comparison(trial)] for session in sessions]
    compared = [trials for trials in compared if trials]
    if not compared:
        return []
    times: Counter[int] = Counter()
    for trials in compared:
        counts = Counter(frozenset((str(t.data.get("first")), str(t.data.get("second")))) for t in trials)
        times.update(counts.values())
    parts = [f"A session has {counted(median(len(trials) for trials in compared), 'comparison')} (median)"]
    parts[0] += (
        f", each pair {'once' if times.most_common(1)[0][0] == 1 else f'{times.most_common(1)[0][0]} times'}."
        if len(times) == 1
        else "."
    )
    places = list(
        dict.fromkeys(str(t.data["first_position"]) for ts in compared for t in ts if "first_position" in t.data)
    )
    if any(place.startswith("interval") for place in places):
        parts.append("The two stimuli of a pair were shown one after the other.")
    elif places:
        parts.append(f"The first stimulus of a pair was at the {listed(places)}.")
    return parts


def _compared(compared: Summary | GroupedSummary, adjustment: str, cited: Citations) -> str:
    if isinstance(compared, Summary):
        return _pairs(compared, compared, adjustment, cited)
    words = (
        f"Stimuli were compared within each of {len(compared.groups)} groups ({compared.factor}) only, and each group "
        f"has a scale of its own. {_pairs(compared.groups[0][1], compared, adjustment, cited)}"
    )
    firth = [name for name, part in compared.groups if part.estimate.method == "firth"]
    if firth and compared.groups[0][1].estimate.method != "firth":
        words += (
            f" In {listed(firth)}, where separation was complete, scores were fitted by Firth's penalised likelihood "
            f"{cited.cite('Firth1993')}."
        )
    if compared.pooled is not None:
        words += (
            " A pooled scale was fitted to all answers, with stimuli of different groups as one where their other "
            "factors agree"
        )
        test = compared.scored.agreement
        words += (
            "; whether it serves all groups was tested by a score test against a scale for each, its statistic "
            f"compared with the spread between observers {cited.cite('Dempster1958')}."
            if test is not None and test.p is not None
            else "."
        )
    return words


def _pairs(summary: Summary, whole: Answered, adjustment: str, cited: Citations) -> str:
    estimate = summary.estimate
    model = f"the Bradley-Terry model {cited.cite('Bradley1952')}"
    fitted = {
        "ml": f"Scores are those of {model}, fitted by maximum likelihood.",
        "firth": f"Scores are those of {model}, fitted by Firth's penalised likelihood {cited.cite('Firth1993')}, "
        "because of complete separation."
        if estimate.method == "firth"
        else "",
        "learnt_prior": f"Scores are those of {model}: the posterior mean, by expectation propagation "
        f"{cited.cite('Minka2001')}, under a normal prior. The prior's standard deviation "
        f"({fixed(estimate.prior_sd, 2)} nats) was estimated from the answers, and its uncertainty is included "
        f"{cited.cite('Gelman2006')}. The reason is that pairs were chosen by earlier answers."
        if estimate.method == "learnt_prior"
        else "",
    }[estimate.method]
    parts = [fitted]
    if whole.comparisons.ties:
        parts.append(f"{counted(whole.comparisons.ties, 'tie')} were left out of the scores.")
    parts.append(
        "95 % intervals are quantiles of that posterior"
        + (", scaled by how much observers differ." if estimate.covariance == "scaled" else ".")
        if estimate.method == "learnt_prior"
        else "95 % intervals follow by the delta method from the same covariance as the classes"
        + (", with Student's t." if estimate.covariance != "model" else ".")
    )
    if summary.scores.classes is not None:
        keys = {"shrinkage": ("Ledoit2004", "Bell2002"), "sandwich": ("White1982", "Bell2002")}
        works = keys.get(estimate.covariance, ())
        errors = f"{estimate.error_words}{' ' + cited.cite(*works) if works else ''}"
        source = {"holm": ("Holm1979",), "bh": ("Benjamini1995",)}.get(summary.adjust, ())
        correction = f"{adjustment}{' ' + cited.cite(*source) if source else ''}"
        parts.append(
            f"Two stimuli share a perceptual class if their scores do not differ at level {summary.alpha:g}, by "
            f"{errors}, with {correction}; classes are a compact letter display {cited.cite('Piepho2004')}."
        )
    if whole is summary and summary.fit_p is not None and estimate.method == "ml":
        fit = summary.scores.fit
        fitted = f"The model's deviance is {fixed(fit.deviance, 1)} on {fit.df} degrees of freedom"
        if summary.one_scale is not None and summary.one_scale.by_observers:
            fitted += (
                "; whether one scale fits is tested by Pearson's statistic with a score bootstrap over observers "
                f"{cited.cite('Kline2012', 'Webb2023')}"
            )
        parts.append(f"{fitted}.")
    if whole.first_share is not None:
        wilson, kish = cited.cite("Wilson1927"), cited.cite("Kish1965")
        parts.append(f"Shares have Wilson's intervals {wilson}, for the effective number of answers {kish}.")
    return " ".join(parts)


def _others(
    cited: Citations,
    *,
    series: SeriesSummary | None,
    ratings: RatingSummary | None,
    preferences: bool,
    factors: bool,
    observers: bool,
) -> str:
    parts = []
    if observers:
        parts.append(f"Circular triads and Kendall's u are those of {cited.cite('Kendall1940')}.")
    if factors:
        parts.append(
            "Effects of the stimuli's factors are those of a Bradley-Terry model whose log strengths are linear in "
            f"them {cited.cite('Springall1973')}, with likelihood-ratio tests of type II."
        )
    if series:
        if series.weight:
            parts.append(f"{weighting(series)} The scores are those of {cited.cite('Medina2016')}.")
        parts.append(
            "Intervals are percentile intervals by bootstrap over observers, at levels widened for few observers "
            f"{cited.cite('Hesterberg2015')}. The just noticeable step is 0.674 standard deviations of an "
            f"observer's matches {cited.cite('Gescheider1997')}. Tests between series are permutation tests within "
            f"observers, with Holm's correction {cited.cite('Holm1979')}; several series are compared by Friedman's "
            f"test {cited.cite('Friedman1937')}."
        )
    if preferences:
        parts.append(
            "Shares for stereo have percentile intervals by bootstrap over observers, at levels widened for few "
            f"observers {cited.cite('Hesterberg2015')}; the sign test is over observers."
        )
    if ratings:
        what = "Mean opinion scores" if any(scale.of == "alone" for scale in ratings.scales) else "Mean ratings"
        if all(scale.ends for scale in ratings.scales):
            how = (
                "that stay on the scale: Wilson's for shares, at the answers that would have the variance of the "
                f"observers' means with one more that differs by a point {cited.cite('Wilson1927')}"
            )
        else:
            how = f"by Student's t over the observers' means {cited.cite('ITU500')}"
        parts.append(f"{what} have 95 % intervals {how}.")
    return " ".join(parts)


_FUNCTIONS = {"weibull": "Weibull", "logistic": "logistic", "normal": "cumulative normal"}


def _thresholds(sessions: Sequence[SessionLog], cited: Citations) -> str:
    """Say how levels were chosen, and how thresholds were estimated."""
    trials = [trial.data for session in sessions for trial in session.trials if trial.kind == "threshold"]
    methods = dict.fromkeys(data.get("method") for data in trials)
    words = {
        "quest_plus": f"QUEST+ {cited.cite('Watson2017')}",
        "staircase": f"weighted up-down staircases {cited.cite('Kaernbach1991')}",
    }
    by = listed(words[method] for method in words if method in methods)
    functions = listed(name for key, name in _FUNCTIONS.items() if key in {data.get("function") for data in trials})
    return (
        f"Levels were chosen by {by}. Thresholds, slopes and rates are those of the {functions} function, of each "
        f"observer from the posterior over a grid of parameters {cited.cite('Schutt2016')}; means over observers have "
        "percentile intervals by bootstrap over observers, at levels widened for few observers "
        f"{cited.cite('Hesterberg2015')}."
    )


def _software(header: Header) -> str:
    versions = [f"{name} {value}" for name, value in header.software.items() if name not in ("commit", "system")]
    words = f"Sessions were run with {listed(versions)}" if versions else ""
    if header.software.get("commit"):
        words += f" (commit {header.software['commit']})"
    return f"{words}." if words else ""


def _protection(sessions: Sequence[SessionLog]) -> str:
    """Say how many of the logs have checksums, which fit where a report is made, and what is not protected."""
    firsts = [session.chained_from for session in recorded(sessions)]
    if not firsts:
        return ""
    chained = sum(first is not None for first in firsts)
    fits = f"Each line of {counted(chained, 'log')} is chained to the line before by SHA-256, and every checksum fits."
    return " ".join([*([fits] if chained else []), *(f"{sentence}." for sentence in unprotected(firsts))])


def _record(header: Header) -> list[tuple[str, str]]:
    rows = [(f"Display {key_words(name)}", plain(value)) for name, value in header.display.items()]
    rows += [(f"Presentation {key_words(name)}", plain(value)) for name, value in header.presentation.items()]
    rows.append(("Analysis", plain(header.analysis)))
    rows.append(("Seed", str(header.seed)))
    rows.append(("Software", ", ".join(f"{name} {value}" for name, value in header.software.items()) or "–"))
    return rows + [(f"SHA-256 of the {key_words(name)}", str(value)) for name, value in header.hashes.items()]


def _lower(words: str) -> str:
    return words[:1].lower() + words[1:]
