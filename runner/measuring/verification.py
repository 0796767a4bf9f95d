"""How far a display's colours lie from those asked of it: 24 fresh colours, asked in XYZ, shown and measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from devices.colour import delta_e_2000, xyz_to_lab
from devices.colour_matching import DEFAULT_OBSERVER
from devices.display import DisplayModel
from devices.errors import MeasuringError
from devices.readings import (
    SPECTRAL,
    AskedColour,
    Faults,
    Kept,
    Patch,
    PatchEye,
    PatchSet,
    Session,
    Showing,
    Shown,
    Simulated,
    SimulatedDisplay,
    asked_of,
    xyz_from_spectra,
)
from documents import Finding
from documents.arrays import Floats
from documents.text import JsonResult
from runner.measuring.options import Dialogue, InstrumentOptions, ShowOptions
from runner.measuring.station import Order, measure, open_screen
from runner.measuring.take_readings import Outcome
from runner.measuring.target import read_target, wiring_of
from runner.presenter.gamma_check import REMEDY, compare_tables, tables_json

Triple = tuple[float, float, float]
_NO_FAULT = Faults(noise=0.0)
# Of black: readings differ by so much anyway.
_NOISE = 0.05


@dataclass(frozen=True, slots=True)
class Checked(JsonResult):
    """A colour asked, measured, and predicted: XYZ with Y in cd/m², differences in ΔE00 against the display's white.

    ``predicted_XYZ_cd_m2`` is what the display file says of the codes that stood on the screen, and
    ``predicted_delta_e_00`` how far that lies from what was asked: what codes in whole numbers and the gamut cost.
    ``desaturated`` says that the chart's own colour lies outside the gamut and a less saturated one was asked.
    """

    name: str
    asked_XYZ_cd_m2: Triple
    measured_XYZ_cd_m2: Triple
    delta_e_00: float
    desaturated: bool
    predicted_XYZ_cd_m2: Triple
    predicted_delta_e_00: float
    json_keys: ClassVar = {
        "predicted_XYZ_cd_m2": "model_XYZ_cd_m2",
        "predicted_delta_e_00": "model_alone_delta_e_00",
    }
    json_names: ClassVar = (
        "name asked_XYZ_cd_m2 measured_XYZ_cd_m2 delta_e_00 predicted_XYZ_cd_m2 predicted_delta_e_00 desaturated"
    )


@dataclass(frozen=True, slots=True)
class Spread(JsonResult):
    """The mean, 95th percentile and largest of differences in ΔE00."""

    mean: float
    p95: float
    largest: float
    json_keys: ClassVar = {"largest": "max"}

    @classmethod
    def of(cls, differences: Floats) -> Spread:
        """Return the spread of ``differences``, shape (n,), n at least 1."""
        return cls(float(differences.mean()), float(np.percentile(differences, 95)), float(differences.max()))


@dataclass(frozen=True, slots=True)
class Verdict(JsonResult):
    """The differences of the colours that were read, ``achieved`` and as the model alone has them; the ``missing`` were
    not read.
    """

    colours: tuple[Checked, ...]
    achieved: Spread
    predicted: Spread
    missing: tuple[str, ...] = ()
    json_keys: ClassVar = {"achieved": "delta_e_00", "predicted": "model_alone_delta_e_00"}
    json_names: ClassVar = "achieved predicted missing colours"


@dataclass(frozen=True, slots=True)
class VerificationReport:
    """A verification as far as it went: its log ``file``, and the verdict, None if it stopped or nothing was read."""

    file: Path
    outcome: Outcome
    verdict: Verdict | None


def verify_display(
    display_file: Path,
    instrument: InstrumentOptions,
    show: ShowOptions,
    *,
    mode: str | None = None,
    output: Path | None = None,
    resume: bool = False,
    accept_gamma_table: bool = False,
    dialogue: Dialogue | None = None,
) -> VerificationReport:
    """Show new colours as a session shows its pictures, read them, and report how far off they are.

    Parameters
    ----------
    display_file
        A display file, which needs a ``mode``, or a rig file.
    instrument
        The instrument that reads the light.
    show
        How the colours are shown, and to which eye.
    mode
        The stereo mode; None takes the rig's own.
    output
        The log of the measurement; None names it after the display, the mode and the eye.
    resume
        Whether to resume a verification that stopped.
    accept_gamma_table
        Whether to verify although the graphics card's gamma table is not the one that the display was measured with;
        the log says so.
    dialogue
        How to talk with the person beside it; None: not at all.

    Returns
    -------
    VerificationReport
        The log, what was read, and the verdict in ΔE00; no verdict where the reading was stopped.

    Raises
    ------
    InputError
        If the display was not characterised in this mode, the gamma table is another one, or the measurement cannot
        begin.
    """
    dialogue = dialogue or Dialogue()
    target = read_target(display_file, mode)
    display = target.characterised()
    if target.observer != DEFAULT_OBSERVER and instrument.instrument not in SPECTRAL:
        what = (
            f"the mode '{target.mode.name}' is for the observer {target.observer}; XYZ are read for {DEFAULT_OBSERVER}"
        )
        remedy = f"read spectra (--instrument {' or '.join(sorted(SPECTRAL))}), or verify a mode for {DEFAULT_OBSERVER}"
        raise MeasuringError(Finding(what, str(display_file), remedy=remedy))
    eye = show.eye
    if eye == "both" and display.models.left is not display.models.right:
        what = f"the mode '{target.mode.name}' was characterised per eye"
        raise MeasuringError(Finding(what, str(display_file), remedy="verify one after the other: --eye left"))
    dialogue.note(target.check_eye(eye))
    if target.mode.mixture(display.models) is not None:
        words = f"'{target.mode.name}' mixes both eyes' views into one picture"
        dialogue.note(f"{words}: colours are as near as it comes to them")
    model = display.models.right if eye == "right" else display.models.left
    file = output or display_file.with_name(f"{display_file.stem}-{target.mode.name}-{eye}-verify.jsonl")
    asked = asked_of(model)
    wiring = wiring_of(target, show, instrument, dialogue)
    with open_screen(target, show, asked=asked_XYZ(asked, model)) as screen:
        for warning in screen.surface.facts.remarks:
            dialogue.warn(warning)
        verdict = compare_tables(target.gamma_tables, screen.surface.gamma_tables())
        if verdict.refusal and not accept_gamma_table:
            raise MeasuringError(Finding(verdict.refusal, str(display_file), remedy=REMEDY))
        for remark in filter(None, (verdict.refusal, verdict.warning)):
            dialogue.warn(remark)
        facts = {
            "ambient_XYZ_cd_m2": model.ambient_XYZ_cd_m2.tolist(),
            "asked_XYZ_cd_m2": {colour.name: colour.XYZ_cd_m2.tolist() for colour in asked},
            "measured_gamma_table": tables_json(target.gamma_tables),
            "accepted_gamma_table": accept_gamma_table,
        }
        order = Order((patches_of(asked, model),), show, facts=facts)
        outcome, session = measure(
            file,
            target,
            order,
            screen,
            instrument.instrument,
            wiring,
            resume=resume,
            accept_readings=instrument.accept_readings,
            dialogue=dialogue,
        )
    if doubt := doubt_on_light(session, model):
        dialogue.warn(doubt)
    complete = session.readings and not outcome.stopped
    return VerificationReport(file, outcome, judge(session, asked, display, eye, target.observer) if complete else None)


def doubt_on_light(session: Session, model: DisplayModel) -> str:
    """Return a sentence if black as read is nearer to the display's own than to it and the room's light; else none.

    The display file then has a light that was off while it was verified, and every dark colour comes out too dark.
    """
    read = [
        kept.reading.XYZ_cd_m2[1] for at, kept in session.readings.items() if not any(session.steps[at].patch.codes)
    ]
    room, lit = float(model.ambient_XYZ_cd_m2[1]), float(model.shown_black_XYZ_cd_m2[1])
    black = float(np.mean(read)) if read else np.inf
    if black >= min(lit - room / 2.0, (1.0 - _NOISE) * lit) or not room:
        return ""
    return (
        f"black was read as {black:.3g} cd/m²; with the room's light of the display file it is {lit:.3g}, without it "
        f"{lit - room:.3g}: verify with the room lit as in the experiment, or take ambient_XYZ_cd_m2 out"
    )


def patches_of(asked: tuple[AskedColour, ...], model: DisplayModel) -> PatchSet:
    """Return the colours ``asked`` with the codes that ``model`` alone would show them by."""
    made = []
    for colour in asked:
        red, green, blue = map(float, model.code(colour.XYZ_cd_m2))
        made.append(Patch(colour.name, (red, green, blue)))
    return PatchSet("colorchecker", tuple(made), "ColorChecker Classic, asked in XYZ")


def asked_XYZ(asked: tuple[AskedColour, ...], model: DisplayModel) -> Mapping[str, Floats]:
    """Return what is asked by patch name: the colours, and the black and white that are shown again and again."""
    ends = {"black": model.xyz([0.0] * 3), "white": model.xyz([1.0] * 3)}
    return {**ends, **{colour.name: colour.XYZ_cd_m2 for colour in asked}}


def judge(
    session: Session,
    asked: tuple[AskedColour, ...],
    display: SimulatedDisplay,
    eye: PatchEye,
    observer: str = DEFAULT_OBSERVER,
) -> Verdict:
    """Return how far the readings of ``session`` lie from what was ``asked`` of ``eye``.

    A gain map that makes the whole panel as dim as its dimmest place makes what was asked dimmer too, above the room's
    light. The reference white is the model's at full drive, dimmed alike. For another ``observer`` than CIE 1931 2° the
    readings' XYZ are summed from their spectra. Raises MeasuringError if nothing was read, or spectra are lacking.
    """
    kept = {session.steps[place].patch.name: reading for place, reading in session.readings.items()}
    pairs = [(colour, kept[colour.name]) for colour in asked if colour.name in kept]
    if not pairs:
        raise MeasuringError("none of the colours was read")
    share = 1.0 if display.gain_map is None else display.gain_map.delivered_share
    model = display.models.right if eye == "right" else display.models.left
    room = model.ambient_XYZ_cd_m2
    white = room + share * (model.xyz([1.0, 1.0, 1.0]) - room)
    wanted = room + share * (np.array([colour.XYZ_cd_m2 for colour, _ in pairs]) - room)
    read = np.array([_read_for(reading, observer) for _, reading in pairs])
    modelled = np.array([_predicted(session, reading, display, eye) for _, reading in pairs])
    wanted_lab = xyz_to_lab(wanted, white)
    achieved = delta_e_2000(wanted_lab, xyz_to_lab(read, white))
    predicted = delta_e_2000(wanted_lab, xyz_to_lab(modelled, white))
    colours = tuple(
        Checked(
            colour.name,
            _triple(wanted[row]),
            _triple(read[row]),
            float(achieved[row]),
            colour.desaturated,
            _triple(modelled[row]),
            float(predicted[row]),
        )
        for row, (colour, _) in enumerate(pairs)
    )
    missing = tuple(colour.name for colour in asked if colour.name not in kept)
    return Verdict(colours, Spread.of(achieved), Spread.of(predicted), missing)


def _read_for(kept: Kept, observer: str) -> Floats:
    """Return what was read, XYZ (3,) in cd/m² for ``observer``."""
    reading = kept.reading
    if observer == DEFAULT_OBSERVER:
        return np.array(reading.XYZ_cd_m2)
    if not reading.spectrum:
        what = f"the readings have no spectra, which XYZ for {observer} need"
        raise MeasuringError(Finding(what, remedy=f"read with an instrument that gives them: {', '.join(SPECTRAL)}"))
    return np.asarray(xyz_from_spectra(reading.spectrum, reading.wavelengths_nm, observer)[0])


def _predicted(session: Session, kept: Kept, display: SimulatedDisplay, eye: PatchEye) -> Triple:
    """Return what the display file says of the codes that stood on the screen while ``kept`` was read."""
    step = session.steps[kept.position]
    shown = kept.shown or Shown(step.patch.codes, step.patch.codes if eye == "both" else (0.0, 0.0, 0.0))
    showing = Showing(step.label, shown.own, 0, 0.0, shown.other, step.patch, shown.place)
    return Simulated(display, 0, _NO_FAULT, eye).read(showing).XYZ_cd_m2


def _triple(values: Any) -> Triple:
    X, Y, Z = map(float, values)
    return X, Y, Z
