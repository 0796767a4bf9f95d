"""Opening an instrument by name; the instrument that a person reads."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from devices.display.model import DisplayModel
from devices.errors import DeviceError
from devices.readings.arrangement import PatchEye
from devices.readings.instrument import Instrument, LostError, PatchOnScreen, RangeError, Reading
from devices.readings.protocol import LineInstrument, read_protocol
from devices.readings.simulated import Faults, Simulated, SimulatedDisplay
from documents import Finding, InputError
from documents.extensions import Registry


def _wrong(name: str, kind: Any) -> str | None:
    """Return what is wrong with what a package offers as an instrument: a protocol's file, or a class."""
    if isinstance(kind, Path):
        try:
            read_protocol(kind)
        except InputError as error:
            return f"is no protocol: {error.findings[0]}"
        return None
    has_all = isinstance(kind, type) and all(hasattr(kind, word) for word in ("read", "close"))
    return None if has_all else "is neither a protocol's file nor a class with read and close"


INSTRUMENTS: Registry[Any] = Registry(
    "cyclopean.instruments",
    {
        "manual": "devices.readings.open:Manual",
        "simulated": "devices.readings.simulated:Simulated",
    },
    _wrong,
)
_SKIP = ("skip", "s")


def _nobody(prompt: str) -> str | None:
    return None


def _silence(words: str) -> None:
    return None


@dataclass(frozen=True, slots=True)
class Wiring:
    """What instruments may need: a serial ``port``, ``options`` of their own, a person, a display to simulate.

    The last is a ``model``, or a display with two of them and what is between, seen through the lens of ``eye``.
    """

    port: str | None = None
    options: Mapping[str, str] = field(default_factory=dict)
    ask: Callable[[str], str | None] = _nobody
    correct: Callable[[str], None] = _silence
    model: DisplayModel | SimulatedDisplay | None = None
    seed: int = 0
    eye: PatchEye = "both"

    def own_options(self, *known: str) -> Mapping[str, str]:
        """Return the options. Raises DeviceError where there is another than those ``known``."""
        for key in self.options:
            if key not in known:
                remedy = f"it has {', '.join(known)}" if known else "it has none"
                raise DeviceError(Finding(f"the instrument has no option '{key}'", remedy=remedy))
        return self.options


def open_instrument(name: str, wiring: Wiring) -> Instrument:
    """Open the instrument called ``name``, one of `INSTRUMENTS`: ours, or another package's.

    Serial instruments take the options ``answer_s`` and ``measure_s``; a simulated one takes those of
    `devices.readings.simulated.Faults`. A class that is opened otherwise has ``opened``, which takes the wiring.

    Parameters
    ----------
    name
        One of `INSTRUMENTS`, such as ``manual`` or ``simulated``.
    wiring
        The port, the options, the person to ask, and the display to simulate, as far as the instrument needs them.

    Returns
    -------
    Instrument
        The open instrument; its readings are XYZ with Y in cd/m².

    Raises
    ------
    DeviceError
        If there is no such instrument or option, or it cannot be opened.

    Examples
    --------
    >>> from pathlib import Path
    >>> from devices.display import read_display
    >>> model = read_display(Path("configs/displays/asus_vg248qe.yaml")).models("quad-buffered").left
    >>> instrument = open_instrument("simulated", Wiring(model=model))
    >>> type(instrument).__name__
    'Simulated'
    >>> instrument.close()
    """
    if name == "simulated":
        if wiring.model is None:
            remedy = "give a display that was characterised in this mode, to simulate it"
            raise DeviceError(Finding("there is no display model to simulate", remedy=remedy))
        return Simulated(wiring.model, wiring.seed, Faults.parse(dict(wiring.options)), wiring.eye)
    kind = INSTRUMENTS.wanted(name, "instrument", DeviceError)
    opened: Instrument = kind.opened(wiring) if hasattr(kind, "opened") else _serial(name, kind, wiring)
    return opened


def gives_spectra(name: str) -> bool:
    """Say whether the instrument of a name gives spectra; its class says so as ``spectral``."""
    return bool(getattr(INSTRUMENTS.get(name), "spectral", False))


def spectral_instruments() -> tuple[str, ...]:
    """Return the names of those that give spectra; looks through the environment."""
    return tuple(filter(gives_spectra, INSTRUMENTS.names()))


def recorded_name(name: str, instrument: Instrument) -> str:
    """Return what to record of an instrument: as it names itself, and whose it is where it is not ours."""
    whose = INSTRUMENTS.whose(name)
    return f"{instrument.name} (by {whose})" if whose else instrument.name


def _serial(name: str, kind: Any, wiring: Wiring) -> Instrument:
    options = wiring.own_options("answer_s", "measure_s")
    if wiring.port is None:
        from devices.readings.serial_line import ports

        raise DeviceError(
            Finding(f"'{name}' needs a port", remedy=f"--port with one of: {', '.join(ports()) or 'none'}")
        )
    seconds = {key: _seconds(key, text) for key, text in options.items()}
    if isinstance(kind, Path):
        protocol = read_protocol(kind)
        return LineInstrument(protocol, protocol.opened(wiring.port), **seconds)
    opened: Instrument = kind(wiring.port, **seconds)
    return opened


def _seconds(key: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < 36000:
        raise DeviceError(Finding(f"'{key}' is '{text}'", remedy="a number of seconds is needed"))
    return value


class Manual:
    """Asks for X, Y and Z in cd/m² with ``ask``, which shows a prompt and returns what is typed; None at its end.

    ``correct`` gets what is wrong with what was typed.
    """

    name = "typed by hand"

    def __init__(self, ask: Callable[[str], str | None], correct: Callable[[str], None]) -> None:
        self._ask = ask
        self._correct = correct

    @classmethod
    def opened(cls, wiring: Wiring) -> Manual:
        """Return the person of the ``wiring``; there are no options."""
        wiring.own_options()
        return cls(wiring.ask, wiring.correct)

    def read(self, showing: PatchOnScreen) -> Reading:
        """Ask until three numbers are typed; ``skip`` leaves the patch for later."""
        while True:
            typed = self._ask(f"{showing.label}: X Y Z in cd/m², or skip: ")
            if typed is None:
                raise LostError("nobody types any more; resume with --resume")
            if typed.strip().lower() in _SKIP:
                raise RangeError("skipped")
            numbers = _numbers(typed)
            if numbers is not None:
                return Reading(numbers)
            self._correct("three numbers are needed, such as 12.3 13.4 14.5, none below 0")

    def close(self) -> None:
        """Do nothing."""


def _numbers(typed: str) -> tuple[float, float, float] | None:
    try:
        numbers = [float(word) for word in re.split(r"[\s,;]+", typed.strip())]
    except ValueError:
        return None
    if len(numbers) != 3 or not all(math.isfinite(number) and number >= 0 for number in numbers):
        return None
    return numbers[0], numbers[1], numbers[2]
