"""The table of measurements: device codes as sent, XYZ as measured.

The observers that readings are for, as files of measurements write them, and readings turned to another observer.

ArgyllCMS writes ``1931_2``, ``1964_10``, ``2012_2`` and ``2012_10`` (the keyword ``OBSERVER`` of a ``.ti3``, the option
``-Q`` of dispread); its 2012 functions are those that the CIE published in 2015 (CIE 170-2:2015).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike

from devices.colour_matching.observers import DEFAULT_OBSERVER, STANDARD_OBSERVERS, canonical_name
from devices.display.gamma_table import GammaTable
from devices.errors import DeviceError
from devices.readings.arrangement import PatchEye
from documents.arrays import Floats

PATCH_EYES: tuple[PatchEye, ...] = ("left", "right", "both")
CIE_1931_2 = DEFAULT_OBSERVER
OBSERVERS = STANDARD_OBSERVERS
_ARGYLL = {"CIE 1931 2": "1931_2", "CIE 1964 10": "1964_10", "CIE 2015 2": "2012_2", "CIE 2015 10": "2012_10"}


@dataclass(frozen=True, slots=True, eq=False)
class Measurements:
    """Readings of patches, in the order in which they were read.

    ``codes``: device codes as sent, shape (n, 3), in 0..1. ``XYZ``: shape (n, 3), for ``observer``, absolute, Y in
    cd/m².
    ``name``: n names, ``patch1`` and on where none are given. ``time_s``: shape (n,), seconds from the first reading
    or any other moment, or None. ``eye``: through which lens each was read, n of ``left``, ``right``, ``both``.
    ``spectra``: shape (n, m), W/(sr m² nm), at ``wavelengths_nm``, shape (m,), or both None. ``assumptions`` says in
    sentences what the reader of a file took for granted. ``panel`` is what was measured, such as
    ``1920x1080,0.2768,120,8`` (pixels, pixel pitch in mm, Hz, bits), where that is known. ``observer`` is one of
    ``CIE 1931 2``, ``CIE 1964 10``, ``CIE 2015 2`` and ``CIE 2015 10``, or another that
    `devices.colour_matching.colorimetric_observer` knows. ``gamma_table`` is the graphics card's table with which the
    readings hold; None where nothing is said of it. ``area``: shape (n,), the
    share of the picture that each patch filled, above 0 and at most 1; None: all of it each time. ``surround``: shape
    (n, 3), the codes around each patch, in 0..1; None: black. It means nothing where the area is 1.
    ``monitor_settings``: what the monitor's menu said, as JSON (`devices.display.MonitorSettings`), empty if not known.

    Raises DeviceError if shapes disagree, a code or an area lies outside its range, or a number is not finite.
    """

    codes: Floats
    XYZ: Floats
    name: tuple[str, ...] = ()
    time_s: Floats | None = None
    eye: tuple[PatchEye, ...] = ()
    mode: str = ""
    spectra: Floats | None = None
    wavelengths_nm: Floats | None = None
    instrument: str = ""
    notes: str = ""
    assumptions: tuple[str, ...] = ()
    panel: str = ""
    observer: str = CIE_1931_2
    gamma_table: GammaTable | None = None
    area: Floats | None = None
    surround: Floats | None = None
    monitor_settings: str = ""

    def __post_init__(self) -> None:
        count = len(np.asarray(self.codes))
        shapes: dict[str, tuple[int, ...]] = {"codes": (count, 3), "XYZ": (count, 3), "time_s": (count,)}
        shapes |= {"area": (count,), "surround": (count, 3)}
        if (self.spectra is None) != (self.wavelengths_nm is None):
            raise DeviceError("spectra and their wavelengths go together; one of them is missing")
        if self.wavelengths_nm is not None:
            bands = len(np.asarray(self.wavelengths_nm))
            shapes |= {"wavelengths_nm": (bands,), "spectra": (count, bands)}
        for what, shape in shapes.items():
            given = getattr(self, what)
            if given is None:
                continue
            array = np.array(given, dtype=np.float64)
            if array.shape != shape:
                raise DeviceError(f"{what} of {count} measurements has the shape {array.shape}, expected {shape}")
            if not np.all(np.isfinite(array)):
                raise DeviceError(f"{what} of measurements holds a number that is not finite")
            array.flags.writeable = False
            object.__setattr__(self, what, array)
        for what in ("codes", "surround"):
            held = getattr(self, what)
            if count and held is not None and (held.min() < 0 or held.max() > 1):
                raise DeviceError(f"{what} must lie in 0..1; they lie in {held.min():g}..{held.max():g}")
        if count and self.area is not None and (self.area.min() <= 0 or self.area.max() > 1):
            raise DeviceError(f"an area is a share above 0 and at most 1, not {self.area.min():g}..{self.area.max():g}")
        names = self.name or tuple(f"patch{number}" for number in range(1, count + 1))
        eyes = self.eye or ("both",) * count
        if len(names) != count or len(eyes) != count:
            raise DeviceError(f"{count} measurements have {len(names)} names and {len(eyes)} eyes")
        if not set(eyes) <= set(PATCH_EYES):
            raise DeviceError(f"an eye is one of {', '.join(PATCH_EYES)}, not {sorted(set(eyes) - set(PATCH_EYES))}")
        object.__setattr__(self, "name", tuple(names))
        object.__setattr__(self, "eye", tuple(eyes))

    def __len__(self) -> int:
        return len(self.codes)

    def select(self, rows: ArrayLike) -> Measurements:
        """Return the readings of ``rows``: their numbers from 0, or one truth value for each."""
        chosen = np.atleast_1d(np.asarray(rows))
        index = np.flatnonzero(chosen) if chosen.dtype == np.bool_ else chosen.astype(np.intp)
        return replace(
            self,
            codes=self.codes[index],
            XYZ=self.XYZ[index],
            name=tuple(self.name[i] for i in index),
            time_s=None if self.time_s is None else self.time_s[index],
            eye=tuple(self.eye[i] for i in index),
            spectra=None if self.spectra is None else self.spectra[index],
            area=None if self.area is None else self.area[index],
            surround=None if self.surround is None else self.surround[index],
        )

    def for_eye(self, eye: PatchEye) -> Measurements:
        """Return the readings through the lens of ``eye``, and those that hold for both."""
        return self.select(np.array([lens in (eye, "both") for lens in self.eye], dtype=bool))

    @property
    def filled(self) -> Floats:
        """The share of the picture that each patch filled, shape (n,): 1 where nothing else is known."""
        return np.ones(len(self)) if self.area is None else self.area

    @property
    def around(self) -> Floats:
        """The codes around each patch, shape (n, 3), in 0..1: black where nothing else is known."""
        return np.zeros((len(self), 3)) if self.surround is None else self.surround

    def says(self, *sentences: str) -> Measurements:
        """Return the same table with more ``assumptions``."""
        return replace(self, assumptions=self.assumptions + sentences)


def joined(tables: Sequence[Measurements]) -> Measurements:
    """Return the readings of ``tables`` one after the other; spectra stay only where all are of the same wavelengths.

    Raises
    ------
    DeviceError
        If there is no table, or their modes or observers differ.
    """
    if not tables:
        raise DeviceError("there are no measurements to join")
    modes = {table.mode for table in tables if table.mode}
    if len(modes) > 1:
        raise DeviceError(f"measurements in different modes cannot be joined: {', '.join(sorted(modes))}")
    observers = {table.observer for table in tables}
    if len(observers) > 1:
        raise DeviceError(f"measurements for different observers cannot be joined: {', '.join(sorted(observers))}")
    first = tables[0]
    of_first = first.gamma_table
    gamma = [table.gamma_table for table in tables]
    one_table = all(g is not None and of_first is not None and (g is of_first or of_first.same_as(g)) for g in gamma)
    panels = {table.panel for table in tables}
    settings = {table.monitor_settings for table in tables}
    waves = [table.wavelengths_nm for table in tables]
    same = all(
        w is not None and first.wavelengths_nm is not None and np.array_equal(w, first.wavelengths_nm) for w in waves
    )
    timed = all(table.time_s is not None for table in tables)
    texts = {
        field.name: "; ".join(dict.fromkeys(text for table in tables if (text := getattr(table, field.name))))
        for field in fields(Measurements)
        if field.name in ("instrument", "notes")
    }
    return Measurements(
        np.concatenate([table.codes for table in tables]),
        np.concatenate([table.XYZ for table in tables]),
        tuple(name for table in tables for name in table.name),
        np.concatenate([t for table in tables if (t := table.time_s) is not None]) if timed else None,
        tuple(eye for table in tables for eye in table.eye),
        modes.pop() if modes else "",
        np.concatenate([s for table in tables if (s := table.spectra) is not None]) if same else None,
        first.wavelengths_nm if same else None,
        texts["instrument"],
        texts["notes"],
        tuple(dict.fromkeys(assumption for table in tables for assumption in table.assumptions)),
        panels.pop() if len(panels) == 1 else "",
        first.observer,
        of_first if one_table else None,
        None if all(table.area is None for table in tables) else np.concatenate([table.filled for table in tables]),
        None if all(table.surround is None for table in tables) else np.concatenate([table.around for table in tables]),
        settings.pop() if len(settings) == 1 else "",
    )


def observer_name(text: str) -> str | None:
    """Return which of the observers' names ``text`` means, such as ``1964_10``; None if it means none of them."""
    try:
        return canonical_name(text)
    except DeviceError:
        return None


def argyll_observer(observer: str) -> str:
    """Return how ArgyllCMS writes ``observer``; the name itself where it has none."""
    return _ARGYLL.get(observer, observer)
