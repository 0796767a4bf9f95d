"""How far a display's colours lie from those asked of it: 24 fresh colours, asked in XYZ, shown and measured."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from devices.colour import delta_e_2000, xyz_to_lab
from devices.colour_matching import DEFAULT_OBSERVER
from devices.display import DisplayModel
from devices.errors import MeasuringError
from devices.readings import (
    AskedColour,
    Faults,
    KeptReading,
    Patch,
    PatchEye,
    PatchOnScreen,
    PatchSet,
    ReadingRun,
    ShownPatch,
    Simulated,
    SimulatedDisplay,
    asked_of,
    gives_spectra,
    spectral_instruments,
    xyz_from_spectra,
)
from documents import Finding, WorkError
from documents.arrays import Floats
from documents.pages import Block, Table
from documents.text import JsonResult
from runner.measuring.options import Dialogue, VerifyOptions
from runner.measuring.station import Order, measure, open_screen
from runner.measuring.take_readings import TakenReadings
from runner.measuring.target import read_target, wiring_of
from runner.presenter.gamma_check import REMEDY, compare_tables, tables_json

Triple = tuple[float, float, float]
_NO_FAULT = Faults(noise=0.0)
# Of black: readings differ by so much anyway.
_NOISE = 0.05


@dataclass(frozen=True, slots=True)
class VerifiedColour(JsonResult):
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

    @property
    def cells(self) -> tuple[str, ...]:
        """The colour as people read it in a table: a star at its name if it was asked less saturated."""
        asked, measured = (
            " ".join(f"{value:8.3f}" for value in XYZ) for XYZ in (self.asked_XYZ_cd_m2, self.measured_XYZ_cd_m2)
        )
        differences = (f"{value:.3f}" for value in (self.delta_e_00, self.predicted_delta_e_00))
        return (self.name + ("*" if self.desaturated else ""), asked, measured, *differences)


@dataclass(frozen=True, slots=True)
class DeltaESpread(JsonResult):
    """The mean, 95th percentile and largest of differences in ΔE00."""

    mean: float
    p95: float
    largest: float
    json_keys: ClassVar = {"largest": "max"}

    @classmethod
    def of(cls, differences: Floats) -> DeltaESpread:
        """Return the spread of ``differences``, shape (n,), n at least 1."""
        return cls(float(differences.mean()), float(np.percentile(differences, 95)), float(differences.max()))


@dataclass(frozen=True, slots=True)
class DisplayVerification(JsonResult):
    """The differences of the colours that were read, ``achieved`` and as the model alone has them; the ``missing`` were
    not read.
    """

    colours: tuple[VerifiedColour, ...]
    achieved: DeltaESpread
    predicted: DeltaESpread
    missing: tuple[str, ...] = ()
    json_keys: ClassVar = {"achieved": "delta_e_00", "predicted": "model_alone_delta_e_00"}
    json_names: ClassVar = "achieved predicted missing colours"


@dataclass(frozen=True, slots=True)
class VerificationReport(JsonResult):
    """A verification as far as it went: its log ``file``, and the verdict, None if it stopped or nothing was read.

    ``limit`` is the mean ΔE00 that must not be passed, None for none.
    """

    file: Path
    outcome: TakenReadings
    verdict: DisplayVerification | None
    limit: float | None = None
    json_keys: ClassVar = {"file": "measurement", "verdict": "*"}
    json_names: ClassVar = "file limit passed verdict"

    @property
    def passed(self) -> bool | None:
        """Whether the mean is within the limit; None without one."""
        return None if self.verdict is None or self.limit is None else self.verdict.achieved.mean <= self.limit

    @property
    def failure(self) -> WorkError | None:
        """What to raise where colours are missing or the limit is passed."""
        if self.verdict is not None and self.passed is False:
            too_far = WorkError(f"the mean ΔE00 is {self.verdict.achieved.mean:.3f}, above the limit of {self.limit:g}")
        else:
            too_far = None
        return self.outcome.failure(self.file) or too_far

    def told(self) -> Iterator[str | Block]:
        """Yield each colour, asked and measured, and the spread of the differences."""
        if (verdict := self.verdict) is None:
            return
        rows = [colour.cells for colour in verdict.colours]
        yield Table.of_texts("", ("colour", "asked X Y Z", "measured X Y Z", "ΔE00", "model alone"), rows)
        if any(colour.desaturated for colour in verdict.colours):
            yield "* outside the display's gamut: asked less saturated"
        for name, spread in (("achieved", verdict.achieved), ("by the model alone", verdict.predicted)):
            yield f"ΔE00 {name}: mean {spread.mean:.3f}, 95 % below {spread.p95:.3f}, largest {spread.largest:.3f}"


def verify_display(options: VerifyOptions, dialogue: Dialogue | None = None) -> VerificationReport:
    """Show new colours, read them, and report the colour error.

    The 24 colours of the ColorChecker are asked in XYZ, adapted and scaled into the display's gamut, and shown as a
    session shows its pictures: by the same shader, with crosstalk cancelled and the panel evened out, undithered. The
    differences are in ΔE00 against the display's white. Beside them stands what the display file alone predicts of the
    codes shown.

    Parameters
    ----------
    options
        The display or rig file, the instrument, how the colours are shown, and to which eye. Without ``output`` the log
        is named after the display, the mode and the eye.
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
    dialogue, show, instrument = dialogue or Dialogue(), options.show, options.instrument
    display_file = options.display
    target = read_target(display_file, options.mode)
    display = target.characterised()
    if target.observer != DEFAULT_OBSERVER and not gives_spectra(instrument.instrument):
        what = (
            f"the mode '{target.mode.name}' is for the observer {target.observer}; XYZ are read for {DEFAULT_OBSERVER}"
        )
        named = " or ".join(spectral_instruments())
        remedy = f"read spectra (--instrument {named}), or verify a mode for {DEFAULT_OBSERVER}"
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
    file = options.output or display_file.with_name(f"{display_file.stem}-{target.mode.name}-{eye}-verify.jsonl")
    asked = asked_of(model)
    wiring = wiring_of(target, show, instrument, dialogue)
    with open_screen(target, show, asked=asked_XYZ(asked, model)) as screen:
        for warning in screen.surface.facts.remarks:
            dialogue.warn(warning)
        verdict = compare_tables(target.gamma_tables, screen.surface.gamma_tables())
        if verdict.refusal and not options.accept_gamma_table:
            raise MeasuringError(Finding(verdict.refusal, str(display_file), remedy=REMEDY))
        for remark in filter(None, (verdict.refusal, verdict.warning)):
            dialogue.warn(remark)
        facts = {
            "ambient_XYZ_cd_m2": model.ambient_XYZ_cd_m2.tolist(),
            "asked_XYZ_cd_m2": {colour.name: colour.XYZ_cd_m2.tolist() for colour in asked},
            "measured_gamma_table": tables_json(target.gamma_tables),
            "accepted_gamma_table": options.accept_gamma_table,
        }
        order = Order((patches_of(asked, model),), show, facts=facts)
        outcome, session = measure(file, target, order, screen, instrument, wiring, dialogue, resume=options.resume)
    if doubt := doubt_on_light(session, model):
        dialogue.warn(doubt)
    complete = session.readings and not outcome.stopped
    judged = judge(session, asked, display, eye, target.observer) if complete else None
    return VerificationReport(file, outcome, judged, options.limit)


def doubt_on_light(session: ReadingRun, model: DisplayModel) -> str:
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
    session: ReadingRun,
    asked: tuple[AskedColour, ...],
    display: SimulatedDisplay,
    eye: PatchEye,
    observer: str = DEFAULT_OBSERVER,
) -> DisplayVerification:
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
        VerifiedColour(
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
    return DisplayVerification(colours, DeltaESpread.of(achieved), DeltaESpread.of(predicted), missing)


def _read_for(kept: KeptReading, observer: str) -> Floats:
    """Return what was read, XYZ (3,) in cd/m² for ``observer``."""
    reading = kept.reading
    if observer == DEFAULT_OBSERVER:
        return np.array(reading.XYZ_cd_m2)
    if not reading.spectrum:
        what = f"the readings have no spectra, which XYZ for {observer} need"
        raise MeasuringError(
            Finding(what, remedy=f"read with an instrument that gives them: {', '.join(spectral_instruments())}")
        )
    return np.asarray(xyz_from_spectra(reading.spectrum, reading.wavelengths_nm, observer)[0])


def _predicted(session: ReadingRun, kept: KeptReading, display: SimulatedDisplay, eye: PatchEye) -> Triple:
    """Return what the display file says of the codes that stood on the screen while ``kept`` was read."""
    step = session.steps[kept.position]
    shown = kept.shown or ShownPatch(step.patch.codes, step.patch.codes if eye == "both" else (0.0, 0.0, 0.0))
    showing = PatchOnScreen(step.label, shown.own, 0, 0.0, shown.other, step.patch, shown.place)
    return Simulated(display, 0, _NO_FAULT, eye).read(showing).XYZ_cd_m2


def _triple(values: Any) -> Triple:
    X, Y, Z = map(float, values)
    return X, Y, Z
