"""A profile as readings: the measurements that it carries, or its model asked for the light of a set of codes."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from devices.display import GammaTable
from devices.errors import DeviceError
from devices.profiles.profile import IccProfile, MatrixModel, black_beneath, read_profile
from devices.readings.carried_text import CarriedText, carried
from devices.readings.cgats import CgatsTable
from devices.readings.code_range import can_be_modelled
from devices.readings.table import Measurements
from devices.readings.ti3 import parse_ti3
from documents import Finding
from documents.arrays import Floats
from documents.text import counted

# Levels of a model's ramps and of the cube of its mixtures.
_RAMP, _CUBE = 21, 5


def read_profile_measurements(path: str | Path, white_cd_m2: float | None = None) -> Measurements:
    """Read an ICC profile as readings.

    Parameters
    ----------
    path
        The profile of a display, ``.icc`` or ``.icm``.
    white_cd_m2
        Luminance of the white in cd/m², above 0, in place of what the profile says of it.

    Returns
    -------
    Measurements
        The measurements inside the profile, in its tags ``targ``, ``CIED`` and ``DevD``. Where there are none, what its
        table, or its matrix and curves, say of 21 levels of each channel and of grey, and of a cube of 125 mixtures.
        ``assumptions`` says which.

    Raises
    ------
    DeviceError
        As `devices.profiles.read_profile`; if nothing inside says what light a code gives; or if neither the profile
        nor ``white_cd_m2`` says how bright the white is.
    """
    return profile_measurements(read_profile(path), white_cd_m2)


def profile_measurements(profile: IccProfile, white_cd_m2: float | None = None) -> Measurements:
    """Return a profile as readings.

    Parameters
    ----------
    profile
        A profile that `devices.profiles.read_profile` has read.
    white_cd_m2
        Luminance of the white in cd/m², above 0, in place of what the profile says of it.

    Returns
    -------
    Measurements
        As `devices.readings.read_profile_measurements`.

    Raises
    ------
    DeviceError
        As `devices.readings.read_profile_measurements`.
    """
    kept = carried(profile)
    if kept is not None:
        return _carried_readings(kept, profile, white_cd_m2)
    return _sampled(profile, white_cd_m2)


def _carried_readings(text: CarriedText, profile: IccProfile, white_cd_m2: float | None) -> Measurements:
    readings = parse_ti3(text.lines, text.place)
    notes = [f"the {counted(len(readings), 'reading', 'readings')} inside the profile were read"]
    if _relative(text.table, readings, known=not (white_cd_m2 is None and profile.luminance_cd_m2 is None)):
        luminance = profile.white_cd_m2(white_cd_m2)
        whose = "--white-cd-m2" if white_cd_m2 is not None else "the profile's 'lumi'"
        notes.append(f"their XYZ are relative, and were brought to cd/m² by a white of {luminance:g} ({whose})")
        scale = luminance / 100.0
        spectra = None if readings.spectra is None else readings.spectra * scale
        kept = tuple(said for said in readings.assumptions if "relative to a white of Y = 100" not in said)
        readings = replace(readings, XYZ=readings.XYZ * scale, spectra=spectra, assumptions=kept)
    elif white_cd_m2 is not None:
        raise DeviceError(
            Finding(
                f"the readings inside the profile are in cd/m², and --white-cd-m2 {white_cd_m2:g} was given",
                text.place,
                remedy="leave it out",
            )
        )
    return _through_gamma_table(readings, profile).says(*notes)


def _sampled(profile: IccProfile, white_cd_m2: float | None) -> Measurements:
    """Return what the profile's table, or its matrix and curves, say of a set of codes."""
    codes = sampled_codes()
    light = profile.light
    source = "the matrix and curves"
    if not isinstance(light, MatrixModel):
        relative = profile.table_name == "A2B1"
        source = f"the {'relative colorimetric' if relative else 'only'} table ('{profile.table_name}')"
    luminance = profile.white_cd_m2(white_cd_m2)
    absolute = profile.absolute(light.xyz(codes), luminance)
    notes = [
        f"the profile holds no measurements: its model, {source}, was asked for {len(codes)} colours, so that "
        "differences from them say nothing of the display",
        *profile.notes,
    ]
    if isinstance(light, MatrixModel) and (black := black_beneath(profile, light)) is not None:
        absolute = with_black(absolute, black, luminance)
        notes.append("black is the profile's black point ('bkpt')")
    dark = float(absolute[0, 1])
    if dark <= 0:
        notes.append("the profile's black gives no light; measure the black, which no display lacks")
    white = 1.0 if isinstance(light, MatrixModel) else float(light.xyz(np.ones((1, 3)))[0, 1])
    if not math.isclose(white, 1.0, abs_tol=0.01):
        notes.append(f"the table's white has Y = {white:.4g}; Y = 1 was taken for {luminance:g} cd/m²")
    names = tuple("r{:.4g} g{:.4g} b{:.4g}".format(*(255.0 * row)) for row in codes)
    return _through_gamma_table(Measurements(codes, absolute, names, assumptions=tuple(notes)), profile)


def _relative(table: CgatsTable, readings: Measurements, *, known: bool) -> bool:
    """Whether the XYZ of ``readings`` are relative to a white of Y = 100.

    The table says so, or, as old ones do, says nothing and its white is 100.00: then, if it is ``known`` how bright the
    white is. Otherwise the readings are taken as they are, of which the fit warns.
    """
    said = table.keywords.get("NORMALIZED_TO_Y_100")
    if "LUMINANCE_XYZ_CDM2" in table.keywords or (said is not None and said.text.strip().upper() != "YES"):
        return False
    return said is not None or (known and len(readings) > 0 and abs(float(readings.XYZ[:, 1].max()) - 100.0) < 0.005)


def _through_gamma_table(readings: Measurements, profile: IccProfile) -> Measurements:
    """Return ``readings`` with the codes that the profile's gamma table sent, unless another has been applied.

    Where no model could be fitted to these codes, the table stays that of the readings.
    """
    table = profile.gamma_table
    if table is None or readings.gamma_table is not None:
        return readings
    if table.is_identity:
        return replace(readings, gamma_table=table)
    sent = table.at(readings.codes)
    if not can_be_modelled(table.shares[0], readings.codes, sent):
        words = f"the profile goes with a gamma table ('vcgt'), {table.sentence()}"
        return replace(readings, gamma_table=table).says(f"{words}: the model holds only while that table is loaded")
    words = (
        f"the profile's gamma table ('vcgt'), {table.sentence()}, was applied to the codes, so that the model is right "
        "with an identity table"
    )
    return replace(readings, codes=sent, gamma_table=GammaTable.identity(2)).says(words)


def sampled_codes() -> Floats:
    """Return the codes (n, 3) that a model is asked for, black first: ramps of channels and grey, and a cube."""
    ramp = np.linspace(0.0, 1.0, _RAMP)
    ramps = [ramp[:, None] * np.array(direction) for direction in (*np.eye(3), np.ones(3))]
    axis = np.linspace(0.0, 1.0, _CUBE)
    cube = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.asarray(np.unique(np.round(np.concatenate([*ramps, cube]), 12), axis=0))


def with_black(XYZ_cd_m2: Floats, black: Floats, white_cd_m2: float) -> Floats:
    """Return XYZ (n, 3) with ``black`` (a share of white) beneath, scaled so that white stays where it is."""
    return np.asarray(XYZ_cd_m2 * (1.0 - black[1]) + black * white_cd_m2)
