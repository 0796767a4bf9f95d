"""What a person chooses of a measurement: which patches, how they are shown, what reads them, and how it talks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from devices.readings import PatchEye
    from runner.measuring.take_readings import Progress


@dataclass(frozen=True, slots=True)
class ShowOptions:
    """How patches are shown.

    ``seed`` shuffles their order, black and white come again after ``repeat_every`` of them (0: never), and each stands
    for ``settle_s`` before it is read. ``backend`` is ``window``, ``egl`` or ``null``; the last two have no keys.
    ``monitors`` are those for the window, by name or number, in place of the rig's.
    """

    eye: PatchEye = "both"
    seed: int = 1
    repeat_every: int = 12
    settle_s: float = 1.0
    backend: str = "window"
    windowed: bool = False
    monitors: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class PatchOptions:
    """Which patches are shown: names of sets or CSV files, the range of the files' codes, the warm-up's interval.

    ``area`` is the share of the picture that patches fill which would fill all of it, and ``surround`` the grey around
    them, a code in 0..1; both None: they fill it.
    """

    set_names: tuple[str, ...] = ("table_c1",)
    code_range: str | None = None
    every_s: float | None = None
    area: float | None = None
    surround: float | None = None


@dataclass(frozen=True, slots=True)
class InstrumentOptions:
    """What reads the light: one of `devices.readings.INSTRUMENTS`, its serial port, and options of its own.

    With ``accept_readings`` a measurement goes on where readings make no sense (`runner.measuring.judge`), and says so.
    """

    instrument: str
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
