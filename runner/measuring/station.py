"""Where a measurement is made: the screen in its stereo mode, the instrument and the log, opened and closed."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.compensation.compensate import Correction
from devices.display.display_file import EyeModels
from devices.display.model import DisplayModel
from devices.errors import MeasuringError
from devices.instruments import open_instrument
from devices.instruments.open import Wiring
from devices.instruments.simulated import SimulatedDisplay
from devices.measurements.log import MeasurementLog, Session, read_session, step_facts
from devices.patches import PatchEye, PatchSet, Step, steps
from documents import Finding
from documents.text.words import did_you_mean
from runner.measuring.asked_screen import AskedScreen
from runner.measuring.code_screen import CodeScreen
from runner.measuring.patch_screen import PatchScreen
from runner.measuring.take_readings import Outcome, Progress, take_readings
from runner.measuring.target import Target
from runner.presenter.surfaces.surface import open_surface

Floats = NDArray[np.float64]
# What a measurement that is gone on with must have in common with how it began.
_KEPT_ALIKE = ("display", "mode", "mode_options", "eye", "set", "seed", "repeat_every", "highest_code", "steps")


@dataclass(frozen=True, slots=True)
class Order:
    """What is to be shown to whom, and how: ``eye`` is left, right or both."""

    sets: tuple[PatchSet, ...]
    eye: PatchEye = "both"
    seed: int = 1
    repeat_every: int = 12
    settle_s: float = 1.0
    notes: str = ""
    facts: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Talk:
    """What is told while it runs: after each patch, and in words.

    ``ready`` is as in `take_readings`.
    """

    on_progress: Callable[[Progress], None] = lambda progress: None
    tell: Callable[[str], None] = lambda words: None
    ready: Callable[[str], bool] | None = None


@contextmanager
def open_screen(
    target: Target, backend: str, *, windowed: bool = False, asked: Mapping[str, Floats] | None = None
) -> Iterator[PatchScreen]:
    """Open a screen on ``target``, and close it: of device codes, or of colours ``asked`` in XYZ by patch name.

    Raises
    ------
    InputError
        If it cannot be opened, or colours are asked of a display that was not characterised in this mode.
    """
    mode, panel = target.mode, target.panel
    with ExitStack() as opened:
        surface = opened.enter_context(
            open_surface(
                backend,
                panel.resolution_px,
                stereo=mode.needs_stereo,
                windowed=windowed,
                windows=mode.windows,
                bits=panel.code_bits,
            )
        )
        if asked is None:
            yield opened.enter_context(CodeScreen(surface, mode))
        else:
            models = characterised(target).models
            correction = Correction(target.crosstalk, target.gain_map)
            yield opened.enter_context(AskedScreen(surface, mode, models, correction, asked))


def characterised(target: Target) -> SimulatedDisplay:
    """Return all that was measured of ``target``; raise MeasuringError if it was not characterised in its mode."""
    if target.simulated is None:
        what = f"the display was not characterised in the mode '{target.mode.name}'"
        raise MeasuringError(Finding(what, str(target.display_file), remedy="measure it, and fit a model"))
    return target.simulated


def check_sets(
    target: Target, sets: Sequence[PatchSet], eye: PatchEye, *, chosen: bool
) -> tuple[tuple[PatchSet, ...], str]:
    """Return those of ``sets`` that can be shown on ``target``, and a remark on the others, empty if there are none.

    Raises
    ------
    MeasuringError
        If one that was ``chosen`` by its name cannot be shown to ``eye`` in this mode, or none is left.
    """
    areas = target.mode.areas(target.panel.resolution_px)
    shared = any(len(area.eyes) > 1 for area in areas)
    parts = any(area.squeeze == (1, 1) and area.rectangle.size_px != target.panel.resolution_px for area in areas)
    kept, remarks = [], []
    for one in sets:
        if shared and any(patch.other is not None for patch in one.patches):
            remarks.append((one.name, "shows both eyes the same pixels", "leave it out"))
        elif parts and eye != "both" and any(patch.place is not None for patch in one.patches):
            remarks.append((one.name, f"shows the {eye} eye a part of the panel alone", "--eye both"))
        else:
            kept.append(one)
    told = [
        Finding(f"'{name}' cannot be measured: '{target.mode.name}' {why}", remedy=remedy)
        for name, why, remedy in remarks
    ]
    if told and (chosen or not kept):
        raise MeasuringError(told)
    return tuple(kept), "; ".join(finding.message for finding in told)


def check_eye(target: Target, eye: str) -> str:
    """Return a remark on measuring ``eye`` alone, empty if there is none.

    Raises
    ------
    MeasuringError
        If the mode has but one picture for both eyes and no filters.
    """
    shared = any(len(area.eyes) > 1 for area in target.mode.areas(target.panel.resolution_px))
    if eye == "both" or not shared:
        return ""
    if target.mode.name == "flat":
        raise MeasuringError(Finding("the mode 'flat' has no picture of its own for an eye", remedy="--eye both"))
    return f"'{target.mode.name}' shows both eyes the same pixels: hold the {eye} filter before the instrument"


def measure(
    file: Path,
    target: Target,
    order: Order,
    screen: PatchScreen,
    instrument: str,
    wiring: Wiring,
    *,
    resume: bool = False,
    again: Sequence[str] = (),
    talk: Talk | None = None,
) -> tuple[Outcome, Session]:
    """Measure, with the readings in ``file``, and return how it went and all readings there are.

    With ``resume``, what ``file`` holds is gone on with; ``again`` are labels of steps to read once more.

    Raises
    ------
    InputError
        If it cannot begin: with a finding each.
    """
    talk = talk or Talk()
    sets = [one.rounded(screen.highest) for one in order.sets]
    planned = steps(sets, order.seed, order.repeat_every, eye=order.eye)
    facts = _facts(target, order, screen, planned)
    log: MeasurementLog | None = None
    begun = datetime.now(UTC)
    wanted: tuple[Step, ...] = planned
    if resume or again:
        log, session = MeasurementLog.reopen(file)
        try:
            _check_alike(session, facts)
            begun = datetime.fromisoformat(str(session.header["begun_utc"]))
            wanted = _chosen(session, again) if again else session.missing
        except BaseException:
            log.close()
            raise
    elif file.exists():
        remedy = "go on with it by --resume, or choose another name"
        raise MeasuringError(Finding("this measurement exists already", str(file), remedy=remedy))
    try:
        opened = open_instrument(instrument, wiring)
        try:
            if log is None:
                log = MeasurementLog.create(file, {"begun_utc": begun.isoformat(), "instrument": opened.name, **facts})
            else:
                before = session.header["instrument"]
                if opened.name != before:
                    talk.tell(f"warning: the measurement began with {before} and goes on with {opened.name}")
                log.note(resumed_utc=datetime.now(UTC).isoformat(), instrument=opened.name, again=list(again))
            elapsed_s = _clock(begun)
            outcome = take_readings(
                screen,
                opened,
                log,
                wanted,
                order.eye,
                order.settle_s,
                elapsed_s,
                talk.on_progress,
                talk.tell,
                talk.ready,
            )
        finally:
            opened.close()
    finally:
        if log is not None:
            log.close()
    return outcome, read_session(file)


def eye_model(models: EyeModels, eye: str) -> DisplayModel:
    """Return the model of ``eye``, the left one's for ``both``."""
    return models.right if eye == "right" else models.left


def _clock(begun: datetime) -> Callable[[], float]:
    """Return what tells the seconds since ``begun``: steady from now on, whatever is done to the system's clock."""
    already_s = max(0.0, (datetime.now(UTC) - begun).total_seconds())
    now_s = time.monotonic()
    return lambda: already_s + time.monotonic() - now_s


def _facts(target: Target, order: Order, screen: PatchScreen, planned: tuple[Step, ...]) -> dict[str, Any]:
    return {
        "display": target.display_file.name,
        "display_sha256": hashlib.sha256(target.display_file.read_bytes()).hexdigest(),
        "panel": target.panel.text,
        "mode": target.mode.name,
        "mode_options": target.mode_options,
        "eye": order.eye,
        "set": " + ".join(one.name for one in order.sets),
        "set_source": "; ".join(one.source for one in order.sets if one.source),
        "seed": order.seed,
        "repeat_every": order.repeat_every,
        "settle_s": order.settle_s,
        "notes": order.notes,
        "highest_code": screen.highest,
        "surface": asdict(screen.surface.facts),
        "software": version("cyclopean"),
        **order.facts,
        "steps": step_facts(planned),
    }


def _check_alike(session: Session, facts: Mapping[str, Any]) -> None:
    import json

    now = json.loads(json.dumps(facts))
    findings = []
    for key in _KEPT_ALIKE:
        if session.header.get(key) != now[key]:
            was = "" if key == "steps" else f": it was {session.header.get(key)!r}, not {now[key]!r}"
            findings.append(Finding(f"the measurement began with other '{key}'{was}", str(session.file)))
    if findings:
        raise MeasuringError(findings)


def _chosen(session: Session, labels: Sequence[str]) -> tuple[Step, ...]:
    known = {step.label: step for step in session.steps}
    findings = []
    for label in labels:
        if label not in known:
            remedy = did_you_mean(label, known, "")
            findings.append(Finding(f"there is no patch '{label}'", str(session.file), remedy=remedy))
    if findings:
        raise MeasuringError(findings)
    chosen = {known[label].position for label in labels}
    return tuple(step for step in session.steps if step.position in chosen)
