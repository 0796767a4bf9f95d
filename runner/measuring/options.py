"""What a person chooses of a measurement: the options of `cyclopean display measure`, `verify` and `patches`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

from devices.readings import PatchEye
from documents.options import MONITOR, Typed

Backend: TypeAlias = Literal["window", "egl", "null"]
# Our own `devices.readings.INSTRUMENTS`: here, so that help appears at once.
INSTRUMENT_NAMES = ("cs2000", "pr655", "spotread", "manual", "simulated")


@dataclass(frozen=True, slots=True)
class ShowPatches:
    """How patches are shown.

    Attributes
    ----------
    eye
        Eye to measure; the other eye sees black.
    seed
        Random seed for the order of the patches.
    repeat_every
        Number of patches after which black and white are shown again; 0: never.
    settle_s
        Time that a patch is shown before it is read.
    backend
        Where to draw; without a window there are no keys.
    windowed
        Use a window instead of the full screen.
    monitors
        Monitor for the window, as `cyclopean doctor` lists them; twice for dual-window, the left eye's first. Default:
        the rig's, else the first of the panel's resolution.
    """

    eye: PatchEye = "both"
    seed: Annotated[int, Typed(least=0, most=1e40)] = 1
    repeat_every: Annotated[int, Typed(least=0)] = 12
    settle_s: Annotated[float, Typed("--settle", "S", least=0)] = 1.0
    backend: Backend = "window"
    windowed: bool = False
    monitors: Annotated[tuple[str, ...], MONITOR] = ()


@dataclass(frozen=True, slots=True)
class PatchOptions:
    """Which patches are shown.

    Attributes
    ----------
    set_names
        Set of patches; repeat for several: table_c1, grey, cube, dark; warm-up, warm-up-places, repeatability,
        additivity, on-white, cable, uniformity, angles, crosstalk, glasses, ambient; all; or FILE.csv.
    code_range
        Range of the codes in FILE.csv, if it does not say: 0..1, 0..255 or 0..1023.
    every_s
        Time between two readings of the warm-up. Default: 60 s.
    area
        Share of the picture that patches fill, in its middle. Default: all of it.
    surround
        Grey around the patches, 0 (black) to 1 (white).
    """

    set_names: Annotated[tuple[str, ...], Typed("--set")] = ("table_c1",)
    code_range: Annotated[str | None, Typed("--codes")] = None
    every_s: Annotated[float | None, Typed("--every", "S", least=0)] = None
    area: Annotated[float | None, Typed(metavar="SHARE", least=0, most=1, above=True)] = None
    surround: Annotated[float | None, Typed(metavar="CODE", least=0, most=1)] = None


def key_and_value(text: str) -> tuple[str, str]:
    """Return KEY and VALUE of ``KEY=VALUE``; ValueError if it is not of that form."""
    key, equals, value = text.partition("=")
    if not equals:
        raise ValueError(f"'{text}' is no option of an instrument: write KEY=VALUE.")
    return key.strip(), value.strip()


def instrument_name(text: str) -> str:
    """Return the name of an instrument, ours or another package's; ValueError where there is none."""
    if text not in INSTRUMENT_NAMES:
        from devices.readings import INSTRUMENTS

        if INSTRUMENTS.get(text) is None:
            raise ValueError(f"'{text}' is no instrument: choose from {', '.join(INSTRUMENTS.names())}.")
    return text


_INSTRUMENT = Typed(metavar=f"[{'|'.join(INSTRUMENT_NAMES)}]", read="runner.measuring.options.instrument_name")
_OWN = Typed("--instrument-option", "KEY=VALUE", read="runner.measuring.options.key_and_value")


@dataclass(frozen=True, slots=True)
class InstrumentOptions:
    """What reads the light.

    Attributes
    ----------
    instrument
        Instrument that reads the light, or the name of another package's.
    port
        Serial port of the instrument, or its number with spotread.
    accept_readings
        Keep readings that make no sense, which else stop the measurement.
    instrument_options
        Option of the instrument: noise=0.01 (simulated), measure_s=400, "spotread=-X panel.ccss".
    unattended
        Say what to move, but do not wait for a key.
    """

    instrument: Annotated[str, _INSTRUMENT]
    port: str | None = None
    accept_readings: bool = False
    instrument_options: Annotated[Mapping[str, str], _OWN] = field(default_factory=dict)
    unattended: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasureOptions:
    """How patches are shown and read with an instrument.

    Attributes
    ----------
    output
        Measurement file to write: NAME.jsonl.
    tables
        Table to write at the end: *.csv, or *.ti3 of ArgyllCMS with spectra; repeat for both.  [default: NAME.csv]
    mode
        Stereo mode; a rig has its own.
    patches
        Which patches are shown.
    notes
        Notes to store with the readings, such as the lens and the room.
    resume
        Resume a measurement: read the patches that have no reading yet.
    again
        Patch to read once more; white#2 is the second white.
    instrument
        What reads the light.
    show
        How patches are shown.
    """

    output: Annotated[Path, Typed("-o --output")]
    tables: Annotated[tuple[Path, ...], Typed("--table", "PATH")] = ()
    mode: str | None = None
    patches: PatchOptions = field(default_factory=PatchOptions)
    notes: str = ""
    resume: bool = False
    again: Annotated[tuple[str, ...], Typed(metavar="NAME")] = ()
    instrument: InstrumentOptions
    show: ShowPatches = field(default_factory=ShowPatches)


@dataclass(frozen=True, slots=True, kw_only=True)
class VerifyOptions:
    """How new colours are shown on a display and read.

    Attributes
    ----------
    display
        Display file or rig file.
    mode
        Stereo mode to verify; a rig has its own.
    output
        Measurement file to write: NAME.jsonl.
    resume
        Resume a verification that stopped.
    accept_gamma_table
        Verify although the graphics card's gamma table is not the measured one; the log states it.
    limit
        Exit with status 1 if the mean ΔE00 is larger than this.
    instrument
        What reads the light.
    show
        How the colours are shown.
    """

    display: Path
    mode: str | None = None
    output: Annotated[Path | None, Typed("-o --output")] = None
    resume: bool = False
    accept_gamma_table: bool = False
    limit: Annotated[float | None, Typed(metavar="DELTA_E", least=0)] = None
    instrument: InstrumentOptions
    show: ShowPatches = field(default_factory=ShowPatches)


@dataclass(frozen=True, slots=True)
class PatchesOptions:
    """How patches are shown for an instrument that nothing here drives.

    Attributes
    ----------
    mode
        Stereo mode; a rig has its own.
    patches
        Which patches are shown.
    each_s
        Show the next patch after so many seconds, without a key.
    start
        Patch to begin with; white#2 is the second white.
    output
        Table of the patches shown, with empty X, Y, Z to fill in.
    list_only
        Print the patches in their order as CSV, and show nothing.
    show
        How they are shown.
    """

    mode: str | None = None
    patches: PatchOptions = field(default_factory=PatchOptions)
    each_s: Annotated[float | None, Typed("--each", "S", least=0, above=True)] = None
    start: Annotated[str | None, Typed(metavar="NAME")] = None
    output: Annotated[Path | None, Typed("-o --output")] = None
    list_only: Annotated[bool, Typed("--list")] = False
    show: ShowPatches = field(default_factory=ShowPatches)


def _say_nothing(words: str) -> None:
    return None


def _no_answer(prompt: str) -> str | None:
    return None


@dataclass(frozen=True, slots=True)
class Dialogue:
    """How a measurement talks with the person beside it.

    ``tell`` gets what must be known, ``say`` how it goes on: a line for each patch. ``ask`` shows a prompt and returns
    what is typed, None at the end of input.
    """

    tell: Callable[[str], None] = _say_nothing
    ask: Callable[[str], str | None] = _no_answer
    say: Callable[[str], None] = _say_nothing

    def note(self, remark: str) -> None:
        """Tell a remark on what was chosen, unless it is empty."""
        if remark:
            self.tell(f"note: {remark}")

    def warn(self, remark: str) -> None:
        """Tell a remark of the screen."""
        self.tell(f"warning: {remark}")
