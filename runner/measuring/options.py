"""What a person chooses of a measurement: which patches, how they are shown, what reads them, and how it talks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

from devices.readings import PatchEye
from documents.options import MONITOR, Typed

if TYPE_CHECKING:
    from runner.measuring.take_readings import Progress


Backend: TypeAlias = Literal["window", "egl", "null"]
# As `devices.readings.INSTRUMENTS` has them: here, so that help appears at once.
Instrument: TypeAlias = Literal["cs2000", "pr655", "spotread", "manual", "simulated"]


@dataclass(frozen=True, slots=True)
class ShowOptions:
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


@dataclass(frozen=True, slots=True)
class InstrumentOptions:
    """What reads the light.

    Attributes
    ----------
    instrument
        Instrument that reads the light.
    port
        Serial port of the instrument, or its number with spotread.
    instrument_options
        Options of the instrument: noise (simulated), measure_s, spotread; each a text.
    accept_readings
        Keep readings that make no sense, which else stop the measurement.
    """

    instrument: Instrument
    port: str | None = None
    instrument_options: Mapping[str, str] = field(default_factory=dict)
    accept_readings: bool = False


def _say_nothing(words: str) -> None:
    return None


def _no_answer(prompt: str) -> str | None:
    return None


def _no_progress(progress: Progress) -> None:
    return None


@dataclass(frozen=True, slots=True)
class Dialogue:
    """How a measurement talks with the person beside it.

    ``on_progress`` is called after each patch, ``say`` with words meanwhile; ``ready`` is as in `take_readings`.
    ``note`` gets remarks on what was chosen (empty ones too), ``warn`` those of the screen. ``ask`` shows a prompt and
    returns what is typed, None at the end of input; ``correct`` gets what is wrong with that.
    """

    on_progress: Callable[[Progress], None] = _no_progress
    say: Callable[[str], None] = _say_nothing
    ready: Callable[[str], bool] | None = None
    note: Callable[[str], None] = _say_nothing
    warn: Callable[[str], None] = _say_nothing
    ask: Callable[[str], str | None] = _no_answer
    correct: Callable[[str], None] = _say_nothing
