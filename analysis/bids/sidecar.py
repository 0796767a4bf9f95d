"""A session's sidecar: how it was made, under the keys that BIDS has, and under keys of its own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from analysis.bids.sources import Source
from analysis.records.session_record import SessionLog


def presentation(log: SessionLog) -> dict[str, Any]:
    """Return the ``StimulusPresentation`` of BIDS: software, screen and distance, with what the log knows of them."""
    header = log.header
    panel = _mapping(header.display.get("panel"))
    told: dict[str, Any] = {"SoftwareName": "cyclopean"}
    for key, value in (
        ("SoftwareVersion", header.software.get("cyclopean")),
        ("OperatingSystem", header.software.get("system")),
    ):
        if isinstance(value, str):
            told[key] = value
    distance_mm = _number(header.display.get("distance_mm"))
    if distance_mm is not None:
        told["ScreenDistance"] = round(distance_mm / 1000, 6)
    refresh_hz = _number(panel.get("refresh_hz"))
    if refresh_hz is not None:
        told["ScreenRefreshRate"] = refresh_hz
    resolution = panel.get("resolution_px")
    if isinstance(resolution, list) and len(resolution) == 2 and all(type(n) is int for n in resolution):
        told["ScreenResolution"] = resolution
        pitch_mm = _number(panel.get("pixel_pitch_mm"))
        if pitch_mm is not None:
            told["ScreenSize"] = [round(n * pitch_mm / 1000, 6) for n in resolution]
    return told


def task_sidecar(source: Source, log: SessionLog) -> dict[str, Any]:
    """Return what BIDS asks of every table of a task."""
    return {
        "TaskName": source.experiment,
        "TaskDescription": f"The question of each comparison was: {log.header.question}",
        "StimulusPresentation": presentation(log),
    }


def session_sidecar(source: Source, log: SessionLog) -> dict[str, Any]:
    """Return what the sidecar of a session's table holds beside the descriptions of the columns."""
    header = log.header
    return {
        **task_sidecar(source, log),
        "SessionStarted": header.started_utc,
        "SessionComplete": log.complete,
        "SimulatedObserver": header.simulated,
        "Question": header.question,
        "StereoMode": header.display.get("mode"),
        "Glasses": header.display.get("glasses"),
        "DisplayCharacterisation": dict(header.display),
        "Stimuli": [dict(stimulus) for stimulus in header.stimuli],
        "SHA256": dict(header.hashes),
        "OrderSeed": header.seed,
        "AnalysisPlan": dict(header.analysis),
        "Software": dict(header.software),
        "GraphicsSystem": dict(header.presentation),
        "Remarks": list(header.remarks),
        "RecordSchemaVersion": header.schema_version,
        "RawRecord": {"URI": f"bids::{source.raw}", "SHA256": source.digest},
    }


def _mapping(value: object) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}


def _number(value: object) -> float | None:
    return value if isinstance(value, int | float) and not isinstance(value, bool) else None
