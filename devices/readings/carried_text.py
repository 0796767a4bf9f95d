"""The measurements that a profile carries as text: by ArgyllCMS whole in one tag, by ProfileMaker in two."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from devices.errors import DeviceError
from devices.profiles.profile import IccProfile
from devices.profiles.tag_table import Tag
from devices.readings.cgats import CgatsTable, read_table

# Where programs keep the readings: Argyll in the first, and with ProfileMaker codes and colours apart in the others.
_TEXTS = ("targ", "CIED", "DevD")
_RGB, _XYZ = ("RGB_R", "RGB_G", "RGB_B"), ("XYZ_X", "XYZ_Y", "XYZ_Z")
_KEYS = ("SAMPLE_ID", "SampleID", "SAMPLE_NAME")


@dataclass(frozen=True, slots=True)
class CarriedText:
    """The ``lines`` of a table of readings, and the ``place`` in the file that findings carry."""

    place: str
    lines: list[str]
    table: CgatsTable


def carried(profile: IccProfile) -> CarriedText | None:
    """Return the measurements inside a profile as text.

    Parameters
    ----------
    profile
        A profile that `devices.profiles.read_profile` has read.

    Returns
    -------
    CarriedText or None
        The lines of a table of codes with XYZ or spectra, from the tag ``targ``, ``CIED`` or ``DevD``, or from the
        latter two joined; None where there is no such table.

    Raises
    ------
    DeviceError
        If a table of readings is damaged.
    """
    tables: dict[str, CarriedText] = {}
    for name in _TEXTS:
        tag = profile.tag(name)
        lines = [] if tag is None else _lines(tag)
        if not any(line.split()[:1] == ["BEGIN_DATA_FORMAT"] for line in lines):
            continue
        place = f"{profile.file}[{name}]"
        text = CarriedText(place, lines, read_table(lines, place))
        if set(_RGB) <= set(text.table.names()) and _has_light(text.table):
            return text
        tables[name] = text
    if "CIED" in tables and "DevD" in tables:
        return _joined(tables["DevD"], tables["CIED"], profile.file)
    return None


def _lines(tag: Tag) -> list[str]:
    """Return the lines of a tag of text, none where it is something else."""
    if tag.type not in ("text", "utf8"):
        return []
    return tag.data[8:].split(b"\0", 1)[0].decode("utf-8", errors="replace").splitlines()


def _has_light(table: CgatsTable) -> bool:
    names = table.names()
    return set(_XYZ) <= set(names) or any(name.startswith("SPEC_") for name in names)


def _joined(codes: CarriedText, colours: CarriedText, file: str) -> CarriedText | None:
    """Return codes and colours of the same samples as one table; None where they are no RGB or no light."""
    key = next((key for key in _KEYS if key in codes.table.names() and key in colours.table.names()), None)
    if key is None or not set(_RGB) <= set(codes.table.names()) or not _has_light(colours.table):
        return None
    at = codes.table.names().index(key)
    own = {row[at].text: row for row in codes.table.rows}
    names = colours.table.names()
    wanted = [name for name in names if name in _XYZ or name.startswith("SPEC_")]
    head = [
        f'{word} "{cell.text}"'
        for word, cell in colours.table.keywords.items()
        if word.startswith(("SPECTRAL_", "NORMALIZED_", "LUMINANCE_", "OBSERVER"))
    ]
    places = [codes.table.names().index(name) for name in _RGB]
    scale = 100.0 / _full_code(row[place].text for row in codes.table.rows for place in places)
    rows = []
    for row in colours.table.rows:
        sample = row[names.index(key)]
        if sample.text not in own:
            raise DeviceError(
                colours.table.finding(f"{key} {sample.text} has no codes in 'DevD'", sample, "codes for each sample")
            )
        code = [_scaled(own[sample.text][place].text, scale) for place in places]
        rows.append(" ".join([f'"{sample.text}"', *code, *(row[names.index(name)].text for name in wanted)]))
    lines = ["CTI3", *head, "BEGIN_DATA_FORMAT", " ".join(["SAMPLE_ID", *_RGB, *wanted]), "END_DATA_FORMAT"]
    lines += ["BEGIN_DATA", *rows, "END_DATA"]
    place = f"{file}[DevD, CIED]"
    return CarriedText(place, lines, read_table(lines, place))


def _full_code(codes: Iterable[str]) -> float:
    """Return the code of full drive: 255 where one is above 100, as ProfileMaker writes them, else 100."""
    return 255.0 if any(_number(code) > 100.0 for code in codes) else 100.0


def _scaled(code: str, scale: float) -> str:
    """Return ``code`` times ``scale``; what is no number stays as it is, to be refused with its line."""
    return code if scale == 1.0 or math.isnan(_number(code)) else repr(_number(code) * scale)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
