"""A measurement on disk: a JSON line for each reading, written and fsynced before the next patch appears.

The first line says what is measured and in which order; then come readings, failures and, where an instrument gives
spectra, the wavelengths that they are at. A patch read again has a later line, which counts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from datetime import datetime
from pathlib import Path
from types import TracebackType
from typing import Any

from devices.errors import MeasuringError
from devices.readings.arrangement import GridCell
from devices.readings.instrument import Reading
from devices.readings.patch import Patch, PatchTurn
from documents import Finding, InputError
from documents.files import (
    MOST_LOG_BYTES,
    DamagedLineError,
    DurableLog,
    LogDisturbedError,
    LogInUseError,
    LogState,
    open_regular,
    read_lines,
    unreadable,
    unwritable,
)

FORMAT = "cyclopean-measurement"
VERSION = 1
_TEXTS = ("begun_utc", "instrument", "mode", "eye", "set", "set_source")
_NUMBERS = ("seed", "highest_code")
_ELSEWHERE = "copy it where it may be written, and go on there with --resume"
CodeTriple = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class ShownPatch:
    """The codes in 0..1 of the eye that is read and of the other one, None where they share their pixels.

    ``place`` is where on the panel the patch's middle stands, across and down, as shares of it. ``read_back`` says that
    the codes were read off the screen, as they are not those of the patch.
    """

    own: CodeTriple
    other: CodeTriple | None
    place: tuple[float, float] = (0.5, 0.5)
    read_back: bool = False


@dataclass(frozen=True, slots=True)
class KeptReading:
    """A reading of the step at ``position``, ``time_s`` after the measurement began.

    ``shown`` are the codes in 0..1 that stood on the screen where they are not the patch's own: those that the eye that
    was read saw, and the other eye's.
    """

    position: int
    time_s: float
    reading: Reading
    shown: ShownPatch | None = None


@dataclass(frozen=True, slots=True)
class ReadingRun:
    """A measurement as far as it went. ``readings`` holds the last of each step, by position.

    ``accepted`` says of which readings a person was told that they make no sense, and kept them. ``state`` says where
    its log ends; a last line that was cut short does not count.
    """

    file: Path
    header: Mapping[str, Any]
    steps: tuple[PatchTurn, ...]
    readings: Mapping[int, KeptReading]
    failures: Mapping[int, str]
    accepted: tuple[str, ...] = ()
    state: LogState = field(default=LogState(), repr=False, compare=False)

    @property
    def torn_tail(self) -> bytes:
        """The bytes of a last line that was cut short, empty if there is none."""
        return self.state.torn_tail

    @property
    def missing(self) -> tuple[PatchTurn, ...]:
        """The steps that have no reading yet."""
        return tuple(step for step in self.steps if step.position not in self.readings)


class MeasurementLog:
    """An open measurement, a `DurableLog`; use as a context manager.

    What `keep`, `fail` and `note` are given is on disk when they return.
    """

    def __init__(self, log: DurableLog) -> None:
        self._log = log
        self._wavelengths_nm: tuple[float, ...] = ()

    @classmethod
    def create(cls, file: Path, header: Mapping[str, Any]) -> MeasurementLog:
        """Make ``file`` with its ``header``, whole or not at all.

        Raises
        ------
        MeasuringError
            If it exists already or cannot be written.
        """
        if file.exists():
            remedy = "resume it with --resume, or choose another name"
            raise MeasuringError(Finding("this measurement exists already", str(file), remedy=remedy))
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            first = {"record": "header", "format": FORMAT, "version": VERSION, **header}
            return cls(DurableLog.create(file, _lock_file(file), first, private=False))
        except LogInUseError as error:
            raise _in_use(file, error) from None
        except OSError as error:
            raise MeasuringError(unwritable(error, file, "measurement")) from error

    @classmethod
    def reopen(cls, file: Path) -> tuple[MeasurementLog, ReadingRun]:
        """Open a measurement to resume it, and return what it holds.

        A line cut short by a power cut is kept beside the log as ``NAME.torn-*.bin`` and taken off its end.

        Raises
        ------
        MeasuringError
            If another process has it open, it is damaged before its last line, or it cannot be written.
        """
        if not file.exists():
            raise MeasuringError(Finding("there is no such measurement", str(file), remedy="begin it without --resume"))
        try:
            torn_file = file.with_name(f"{file.name}.torn.bin")
            log, session = DurableLog.reopen(file, _lock_file(file), torn_file, read_session)
        except LogInUseError as error:
            raise _in_use(file, error) from None
        except OSError as error:
            raise MeasuringError(unwritable(error, file, "measurement", elsewhere=_ELSEWHERE)) from error
        return cls(log), session

    @property
    def file(self) -> Path:
        """The file that it is written to."""
        return self._log.file

    def keep(self, step: PatchTurn, time_s: float, reading: Reading, shown: ShownPatch | None = None) -> None:
        """Put a reading on disk, with what stood on the screen if that was read back."""
        line: dict[str, Any] = {"record": "reading", "position": step.position, "label": step.label}
        line |= {"time_s": round(time_s, 3), "XYZ_cd_m2": reading.XYZ_cd_m2}
        if reading.spectrum:
            if reading.wavelengths_nm != self._wavelengths_nm:
                self._write({"record": "wavelengths", "nm": reading.wavelengths_nm})
                self._wavelengths_nm = reading.wavelengths_nm
            line["spectrum"] = reading.spectrum
        if shown is not None and shown.read_back:
            line["shown"] = {"own": shown.own, "other": shown.other, "place": shown.place}
        self._write(line)

    def fail(self, step: PatchTurn, time_s: float, why: str) -> None:
        """Put on disk why a patch was not read."""
        what = {"record": "failure", "position": step.position, "label": step.label, "why": why}
        self._write({**what, "time_s": round(time_s, 3)})

    def set_aside(self, positions: Sequence[int], why: str) -> None:
        """Put on disk that the readings at ``positions`` no longer count, and why."""
        self._write({"record": "set aside", "positions": list(positions), "why": why})

    def note(self, **facts: Any) -> None:
        """Put other facts on disk, such as when and with what the measurement was resumed."""
        self._write({"record": "note", **facts})

    def close(self) -> None:
        """Close the file and let others open it."""
        try:
            self._log.close()
        except LogDisturbedError as error:
            raise _disturbed(error, self.file) from error

    def __enter__(self) -> MeasurementLog:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _write(self, line: Mapping[str, Any]) -> None:
        try:
            self._log.append(line)
        except LogDisturbedError as error:
            raise _disturbed(error, self.file) from error
        except OSError as error:
            raise MeasuringError(unwritable(error, self.file, "reading", elsewhere=_ELSEWHERE)) from error


def read_session(file: Path) -> ReadingRun:
    """Read the measurement in ``file``; a last line that was cut short does not count.

    Parameters
    ----------
    file
        The log of a measurement, ``.jsonl``.

    Returns
    -------
    ReadingRun
        The header, the steps, and for each step its last reading (XYZ in cd/m²) or why it has none.

    Raises
    ------
    MeasuringError
        If the file is missing, or damaged before its last line, with the line.
    """
    readings: dict[int, KeptReading] = {}
    failures: dict[int, str] = {}
    accepted: list[str] = []
    wavelengths_nm: tuple[float, ...] = ()
    header: dict[str, Any] = {}
    steps: tuple[PatchTurn, ...] = ()

    def take(number: int, line: dict[str, Any]) -> None:
        nonlocal wavelengths_nm, header, steps
        kind = line["record"]
        if number == 1:
            if kind != "header" or line.get("format") != FORMAT or line.get("version") != VERSION:
                raise ValueError("not the header of a measurement")
            _check_facts(line)
            header = line
            steps = _steps(line["steps"])
        elif kind == "wavelengths":
            wavelengths_nm = tuple(map(float, line["nm"]))
        elif kind == "failure":
            failures[_position(line, steps)] = str(line["why"])
        elif kind == "set aside":
            for position in map(int, line["positions"]):
                readings.pop(position, None)
                failures[position] = str(line["why"])
        elif kind == "note" and "accepted" in line:
            accepted.append(str(line["accepted"]))
        elif kind == "reading":
            X, Y, Z = map(float, line["XYZ_cd_m2"])
            spectrum = tuple(map(float, line.get("spectrum", ())))
            reading = Reading((X, Y, Z), spectrum, wavelengths_nm if spectrum else ())
            position = _position(line, steps)
            readings[position] = KeptReading(position, float(line["time_s"]), reading, _shown(line.get("shown")))
            failures.pop(position, None)

    try:
        with open_regular(file, "measurement", limit_bytes=MOST_LOG_BYTES, error=MeasuringError) as stream:
            state = read_lines(stream, take)
    except OSError as error:
        raise MeasuringError(unreadable(error, file, "measurement")) from error
    except DamagedLineError as error:
        what = "the line is damaged" if error.number > 1 else "this is no measurement"
        raise MeasuringError(error.finding(file, what, "restore the file, or measure again")) from error
    if not header:
        what = "this is no measurement: it has no header"
        raise MeasuringError(Finding(what, str(file), 1, remedy="name the .jsonl of display measure"))
    return ReadingRun(file, header, steps, readings, failures, tuple(accepted), state)


def _check_facts(header: Mapping[str, Any]) -> None:
    """Raise ValueError if the header lacks a fact that every measurement has, or has one that is none."""
    for name in _TEXTS:
        if not isinstance(header.get(name), str):
            raise ValueError(f"the header has no text '{name}'")
    for name in _NUMBERS:
        if not isinstance(header.get(name), int | float) or not math.isfinite(header[name]):
            raise ValueError(f"the header has no number '{name}'")
    datetime.fromisoformat(header["begun_utc"])
    if "gamma_table" in header:
        from devices.display.gamma_table import GammaTable

        GammaTable.from_json(header["gamma_table"])


def is_measurement_log(file: Path) -> bool:
    """Return whether ``file`` begins as the log of a measurement does.

    Parameters
    ----------
    file
        Any file.

    Returns
    -------
    bool
        Whether its first line names the format.

    Examples
    --------
    >>> is_measurement_log(Path("experiments/dynamic_range.yaml"))
    False
    """
    try:
        with open_regular(file) as stream:
            return FORMAT.encode() in stream.read(200).split(b"\n")[0]
    except (OSError, InputError):
        return False


def step_facts(steps: tuple[PatchTurn, ...]) -> list[dict[str, Any]]:
    """Return the steps as the header holds them: of a patch's fields, those that say something.

    Parameters
    ----------
    steps
        The showings of patches, in their order.

    Returns
    -------
    list of dict
        For each step its label, its codes in 0..1 and the fields that differ from a plain patch.

    Examples
    --------
    >>> step_facts((PatchTurn(0, "white", Patch("white", (1.0, 1.0, 1.0))),))
    [{'label': 'white', 'name': 'white', 'codes': (1.0, 1.0, 1.0)}]
    """
    return [{"label": step.label, **_patch_facts(step.patch)} for step in steps]


def _patch_facts(patch: Patch) -> dict[str, Any]:
    plain = Patch(patch.name, patch.codes)
    facts: dict[str, Any] = {"name": patch.name, "codes": patch.codes}
    for known in fields(Patch):
        value = getattr(patch, known.name)
        if value != getattr(plain, known.name):
            facts[known.name] = asdict(value) if isinstance(value, GridCell) else value
    return facts


def _steps(held: list[dict[str, Any]]) -> tuple[PatchTurn, ...]:
    return tuple(PatchTurn(position, str(line["label"]), _patch(line)) for position, line in enumerate(held))


def _patch(line: Mapping[str, Any]) -> Patch:
    around, other, place = (line.get(key) for key in ("around", "other", "place"))
    return Patch(
        str(line["name"]),
        _triple(line["codes"]),
        None if around is None else _triple(around),
        None if other is None else _triple(other),
        None if place is None else GridCell(**place),
        line.get("eye"),
        str(line.get("angle", "")),
        bool(line.get("glasses", True)),
        float(line.get("wait_s", 0.0)),
        None if line.get("area") is None else float(line["area"]),
        None if line.get("before") is None else _triple(line["before"]),
        bool(line.get("screen_off", False)),
    )


def _shown(held: Mapping[str, Any] | None) -> ShownPatch | None:
    if held is None:
        return None
    across, down = map(float, held["place"])
    other = held["other"]
    return ShownPatch(_triple(held["own"]), None if other is None else _triple(other), (across, down), read_back=True)


def _triple(values: list[float]) -> tuple[float, float, float]:
    red, green, blue = map(float, values)
    return red, green, blue


def _position(line: Mapping[str, Any], steps: tuple[PatchTurn, ...]) -> int:
    position = line["position"]
    if not isinstance(position, int) or not 0 <= position < len(steps):
        raise ValueError(f"there is no step {position}")
    if line["label"] != steps[position].label:
        raise ValueError(f"step {position} is '{steps[position].label}', not '{line['label']}'")
    return position


def _lock_file(file: Path) -> Path:
    return file.with_name(f".{file.name}.lock")


def _disturbed(error: LogDisturbedError, file: Path) -> MeasuringError:
    remedy = "resume it with --resume" if error.in_place else ""
    return MeasuringError(Finding(str(error), str(file), remedy=remedy))


def _in_use(file: Path, error: LogInUseError) -> MeasuringError:
    what = f"another process is writing this measurement{error.who}"
    return MeasuringError(Finding(what, str(file), remedy=error.remedy))
