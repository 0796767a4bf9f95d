"""The sidecars: definitions of the columns, and how a session was presented."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from analysis.kinds import KINDS, ColumnWords, Trial
from analysis.records import Seen, SessionLog, SessionTimes
from extensions.bids.columns import BidsColumn
from extensions.bids.sources import Source
from extensions.bids.text import escape

# Names that experiments often give; those of a kind of trial stand in its file.
_EXACT: Mapping[str, ColumnWords] = {
    "practice": ColumnWords("Whether the trial was practice, which is not scored."),
    "similarity": ColumnWords("The observer's rating of the similarity, on the experiment's scale."),
    "difficulty": ColumnWords("The observer's rating of the difficulty of the choice, on the experiment's scale."),
    "rating": ColumnWords("The observer's rating on the experiment's scale."),
    "comment": ColumnWords("What the observer wrote, with active characters escaped."),
    "disparity_arcsec": ColumnWords("Binocular disparity.", "arcsec"),
}
_MEASURES: Mapping[str, ColumnWords] = {
    "percent_red": ColumnWords("pixels outside the range of the red channel", "%"),
    "percent_green": ColumnWords("pixels outside the range of the green channel", "%"),
    "percent_blue": ColumnWords("pixels outside the range of the blue channel", "%"),
    "percent_any": ColumnWords("pixels outside the display's gamut", "%"),
    "percent_above_full": ColumnWords("pixels above the full drive of a channel", "%"),
    "delta_e_00_mean": ColumnWords("mean colour difference CIEDE2000 due to clipping to the gamut", "1"),
    "delta_e_00_max": ColumnWords("largest colour difference CIEDE2000 due to clipping to the gamut", "1"),
    "percent_noticed": ColumnWords("pixels changed by clipping to the gamut, as seen through the eye's filter", "%"),
    "projection_delta_e_00_mean": ColumnWords("mean colour difference CIEDE2000 due to the anaglyph itself", "1"),
    "projection_delta_e_00_max": ColumnWords("largest colour difference CIEDE2000 due to the anaglyph itself", "1"),
}
# Units are in the names of the recorded values.
_UNITS: Sequence[tuple[str, str]] = (
    ("_cd_m2", "cd/m^2"),
    ("_arcsec", "arcsec"),
    ("_arcmin", "arcmin"),
    ("_percent", "%"),
    ("_degrees", "deg"),
    ("_deg", "deg"),
    ("_px", "pixel"),
    ("_mm", "mm"),
    ("_hz", "Hz"),
    ("_ms", "ms"),
    ("_s", "s"),
)
_LEVEL = re.compile(r"[a-z][a-z0-9_]*", re.ASCII)
_DEFINED: Mapping[str, dict[str, Any]] = {
    "onset": {
        "Description": "When the answer was recorded, from the start of the session, by the clock of the computer; "
        "subtract response_time for when the question appeared. The start is known to the second, the distance "
        "between two rows to the millisecond. Onsets rise: where the clock was set back before a session was resumed, "
        "they count on from its last record, and the session's sidecar says so (TimesMovedBy).",
        "Units": "s",
        "Format": "number",
    },
    "block": {"Description": "Number of the block in the experiment, from 0.", "Format": "integer"},
    "trial": {"Description": "Number of the trial in its block, from 0.", "Format": "integer"},
    "attempt": {
        "Description": "How often the trial had been answered before. Only the last attempt at a trial is a row; "
        "earlier ones are in the events table.",
        "Format": "integer",
    },
    "response_time": {
        "Description": "From the onset of the last scene with a question to the key event, as known to the program; "
        "when the light on the screen changed was not measured.",
        "Units": "s",
        "Format": "number",
    },
    "utc": {"Description": "Coordinated universal time at which the answer was recorded.", "Format": "datetime"},
    "events": {
        "Description": "Key presses since the last record as JSON: pairs of key and seconds from the scene's onset.",
        "Format": "string",
    },
    "simulated": {"Description": "Whether the observer was simulated.", "Format": "boolean"},
}
EVENT_DEFINITIONS: dict[str, Any] = {
    "onset": {
        "Description": "When it was recorded, from the start of the session, by the clock of the computer; the start "
        "is known to the second.",
        "Units": "s",
        "Format": "number",
    },
    "duration": {"Description": "Not recorded.", "Units": "s", "Format": "number"},
    "trial_type": {
        "Description": "What happened.",
        "Levels": {
            "superseded_answer": "an answer that does not count, because the trial was answered again",
            "mark": "a request to repeat a trial",
            "note": "a note in words",
            "resumption": "the session was resumed after a stop",
        },
        "Format": "string",
    },
    "block": {"Description": "Number of the block it belongs to, from 0.", "Format": "integer"},
    "trial": {
        "Description": "Number of the trial in its block, from 0; for a note, how many of the block's trials had been "
        "answered.",
        "Format": "integer",
    },
    "attempt": {"Description": "How often the trial had been answered before.", "Format": "integer"},
    "by": {
        "Description": "Who made the note or the mark.",
        "Format": "string",
    },
    "response_time": {"Description": "Response time of the superseded answer.", "Units": "s", "Format": "number"},
    "utc": {"Description": "Coordinated universal time at which it was recorded.", "Format": "datetime"},
    "value": {
        "Description": "The words of a note, with active characters escaped; of a superseded answer all that was "
        "recorded, as JSON; of a resumption, as JSON, for how many seconds the session had stood still (gap_s, null "
        "where that is not known because the clock had been set back, by clock_behind_s) and the SHA-256, before and "
        "after, of what had changed.",
        "Format": "string",
    },
}


def fixed(name: str) -> dict[str, Any]:
    """Return the definition of a column that every table has, except ``trial_type``."""
    return dict(_DEFINED[name])


def trial_type(kinds: Sequence[str]) -> dict[str, Any]:
    """Return the definition of ``trial_type`` for trials of ``kinds``."""
    known = {kind: KINDS.get(kind, Trial).description for kind in kinds}
    levels = {escape(kind): words or f"a trial of the kind {escape(kind)}" for kind, words in known.items()}
    return {"Description": "The kind of trial.", "Levels": levels, "Format": "string"}


def describe(column: BidsColumn) -> dict[str, Any]:
    """Return a column's definition for a sidecar: description, units, levels and format."""
    known = _known(column)
    definition: dict[str, Any] = {"Description": known.description}
    if column.holds_json:
        definition["Description"] += " As JSON."
    numeric = column.format in ("number", "integer")
    units = known.units or _units(column)
    if numeric and units:
        definition["Units"] = units
    # Answers to a questionnaire are words of people, not levels.
    if known.levels and column.values and all(_LEVEL.fullmatch(value) for value in column.values):
        definition["Levels"] = {
            value: known.levels.get(value, f"the answer recorded as {value}") for value in column.values
        }
    return {**definition, "Format": column.format}


def _units(column: BidsColumn) -> str | None:
    for part in reversed(column.place):
        for ending, unit in _UNITS:
            if part.endswith(ending):
                return unit
    return None


def _known(column: BidsColumn) -> ColumnWords:
    if len(column.place) == 1 and (words := _words(column.place[0], column.kinds)):
        return words
    if column.place[0] == "clipping" and column.place[-1] in _MEASURES:
        measure = _MEASURES[column.place[-1]]
        between = [escape(part) for part in column.place[1:-1]]
        eyes = [part for part in between if part in ("left", "right")]
        names = [part for part in between if part not in ("left", "right")]
        picture = f"the picture under '{' '.join(names)}'" if names else "the picture"
        eye = f", as the {eyes[0]} eye sees it" if len(eyes) == 1 else ""
        text = f"Of {picture}{eye}: {'percentage of ' if measure.units == '%' else ''}{measure.description}."
        return ColumnWords(text, measure.units)
    where = ", therein ".join(f"'{escape(part)}'" for part in column.place)
    kinds = ", ".join(escape(kind) for kind in column.kinds)
    return ColumnWords(f"What is recorded under {where} by trials of the kind {kinds}.")


def _words(name: str, kinds: Sequence[str]) -> ColumnWords | None:
    """Return the words for a field of that name: of the kinds that have the column, of every kind, of another."""
    records: list[type[Trial]] = [*(KINDS.get(kind, Trial) for kind in kinds), Trial, *KINDS.values()]
    return next((record.columns[name] for record in records if name in record.columns), _EXACT.get(name))


def presentation(log: SessionLog) -> dict[str, Any]:
    """Return the ``StimulusPresentation`` of BIDS: software, screen and distance, as far as they were recorded."""
    header = log.header
    display, panel = header.display, header.display.panel
    known: dict[str, Any] = {"SoftwareName": "cyclopean"}
    for key, name in (("SoftwareVersion", "cyclopean"), ("OperatingSystem", "system")):
        if name in header.software:
            known[key] = header.software[name]
    if display.distance_mm is not None:
        known["ScreenDistance"] = round(display.distance_mm / 1000, 6)
    if panel.refresh_hz is not None:
        known["ScreenRefreshRate"] = panel.refresh_hz
    if panel.resolution_px is not None:
        known["ScreenResolution"] = [*panel.resolution_px]
        if panel.pixel_pitch_mm is not None:
            known["ScreenSize"] = [round(n * panel.pixel_pitch_mm / 1000, 6) for n in panel.resolution_px]
    return known


def task_sidecar(source: Source, log: SessionLog) -> dict[str, Any]:
    """Return the entries that BIDS requires for every table of a task."""
    return {
        "TaskName": source.experiment,
        "TaskDescription": f"The question of each comparison was: {log.header.question}",
        "StimulusPresentation": presentation(log),
    }


def session_sidecar(source: Source, log: SessionLog) -> dict[str, Any]:
    """Return the sidecar of a session's table, without the definitions of the columns."""
    header, nominal = log.header, log.header.display.nominal
    return {
        **task_sidecar(source, log),
        "SessionStarted": header.started_utc,
        "SessionComplete": log.complete,
        **_stops(log),
        "SimulatedObserver": header.simulated,
        **({"Station": header.station} if header.station else {}),
        "Question": header.question,
        "WhatEyesSaw": Seen.of(log).to_json(),
        "StereoMode": header.display.mode,
        "Glasses": header.display.glasses,
        "DisplayCharacterisation": header.display.given(),
        **({"NominalDisplay": f"nominal, not measured: {nominal.words or ''}"} if nominal else {}),
        "Stimuli": [stimulus.given() for stimulus in header.stimuli],
        "SHA256": dict(header.hashes),
        "OrderSeed": header.seed,
        "AnalysisPlan": header.analysis.given(),
        "Software": dict(header.software),
        "GraphicsSystem": header.presentation.given(),
        "Remarks": list(header.remarks),
        "RecordSchemaVersion": header.schema_version,
        "RawRecord": {"URI": f"bids::{source.raw}", "SHA256": source.digest},
    }


def _stops(log: SessionLog) -> dict[str, Any]:
    """Return when the session was resumed, and how far times of an old log were moved so that they rise."""
    times = SessionTimes.of(log)
    stops = [{"Onset": stop.onset_s, "Gap": stop.gap_s, "ClockBehind": stop.clock_behind_s} for stop in times.stops]
    moved = {"TimesMovedBy": times.moved_s} if times.moved_s else {}
    return ({"Resumptions": stops} if stops else {}) | moved
