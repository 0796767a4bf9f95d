"""Files that people and other programs write, as `tests.stress.mutants` mutates them: YAML, tables, readings, logs."""

from __future__ import annotations

import json
import random
import struct
import tempfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np

from tests.stress.mutants import Format

ROOT = Path(__file__).parents[2]

# --- YAML -------------------------------------------------------------------------------------------------------------

DISPLAY = b"""\
schema_version: 1
panel: {resolution_px: [1920, 1080], pixel_pitch_mm: 0.2768, refresh_hz: 120, bits: 8}
modes:
  side-by-side:
    black_XYZ_cd_m2: [0.02, 0.02, 0.03]
    primaries_XYZ_cd_m2: {red: [10.83, 5.62, 0.54], green: [9.67, 18.65, 1.63], blue: [5.68, 2.20, 29.18]}
    curve: {kind: gog, red: {gain: 0.97, offset: 0.02, gamma: 2.1}, green: {gamma: 2.2}, blue: {gamma: 2.3}}
    source: made up
    monitor_settings: {preset: Standard, brightness_percent: 35, gains_percent: {red: 96, green: 94, blue: 88}}
  quad-buffered: {same_as: side-by-side}
"""
DISPLAY_2 = b"""\
schema_version: 1
panel: {resolution_px: [640, 480], pixel_pitch_mm: 0.25}
nominal: srgb
white_cd_m2: 100
modes:
  side-by-side:
    left:
      black_XYZ_cd_m2: [0.02, 0.02, 0.03]
      primaries_XYZ_cd_m2: {red: [10.8, 5.6, 0.5], green: [9.6, 18.6, 1.6], blue: [5.6, 2.2, 29.1]}
      curve: {kind: gog, red: {gamma: 2.1}, green: {gamma: 2.2}, blue: {gamma: 2.3}}
      source: made up
    right:
      black_XYZ_cd_m2: [0.02, 0.02, 0.03]
      primaries_XYZ_cd_m2: {red: [10.8, 5.6, 0.5], green: [9.6, 18.6, 1.6], blue: [5.6, 2.2, 29.1]}
      curve:
        kind: table
        red: {codes: [0, 0.25, 0.5, 1], light: [0, 0.05, 0.2, 1]}
        green: {codes: [0, 0.25, 0.5, 1], light: [0, 0.1, 0.3, 1]}
        blue: {codes: [0, 0.25, 0.5, 1], light: [0, 0.1, 0.4, 1]}
      source: made up
"""
RIG = b"""\
schema_version: 1
display: display.yaml
mode: side-by-side
distance_mm: 700
interpupillary_distance_mm: 65
glasses: shutter glasses
"""
RECIPE = b"""\
schema_version: 1
kind: pictures
views: [stereo, flat]
stimuli:
  - {name: one, file: one.exr, flat_eye: left, factors: {paint: GM1, exposure_s: 1.3}}
  - {name: two, file: two.exr, flat_eye: left, factors: {paint: GM1, exposure_s: 2}}
"""
EXPERIMENT = b"""\
schema_version: 1
name: small
rig: rig.yaml
stimuli: recipe.yaml
question: Which is closer?
layout: {arrangement: vertical, size_mm: [20, 10], gap_mm: 5}
analysis: {alpha: 0.05, adjust: none}
blocks:
  - {kind: instructions, text: Look at the two pictures.}
  - {kind: all_pairs, break_every: 4, repeats: 2}
  - kind: best_of_series
    series: {by: [paint, view], order: exposure_s}
    ratings: [{name: similarity, question: How similar, highest: 5}]
  - {kind: questionnaire, questions: [{name: remarks, kind: text, question: Anything else}]}
"""


def _check(path: Path) -> object:
    """Check a YAML file beside the files that it names; what is wrong with it is raised."""
    from documents import InputError
    from runner.check import CheckOptions, check_file

    for name, text in (("display.yaml", DISPLAY), ("rig.yaml", RIG), ("recipe.yaml", RECIPE)):
        if not (path.parent / name).exists():
            path.parent.joinpath(name).write_bytes(text)
            _pictures(path.parent)
    report = check_file(path, CheckOptions(screen=False, pictures=False))
    if report.errors:
        raise InputError(report.errors)
    return report


def _pictures(folder: Path) -> None:
    from stimuli.pictures import StereoImage, write_exr

    for name in ("one", "two"):
        write_exr(folder / f"{name}.exr", StereoImage.flat(np.full((8, 16, 3), 5.0, dtype=np.float32)))


def _bombs() -> dict[str, bytes]:
    """Return YAML that is small and expands, nests, or is read slowly."""
    levels = "".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]\n" for n in range(1, 30))
    return {
        "aliases": ("a0: &a0 [x, x, x]\n" + levels).encode(),
        "aliases of keys": (
            "a0: &a0 {x: 1}\n" + "".join(f"a{n}: &a{n} {{p: *a{n - 1}, q: *a{n - 1}}}\n" for n in range(1, 60))
        ).encode(),
        "an alias of itself": b"blocks: &a [*a]\n",
        "merged keys": b"a: &a {b: 1}\nc:\n" + b"  <<: *a\n" * 3000,
        "lists in lists": b"blocks: " + b"[" * 5000 + b"]" * 5000,
        "mappings in mappings": b"blocks: " + b"{a: " * 5000 + b"}" * 5000,
        "lists below each other": b"blocks:\n" + b"".join(b" " * n + b"-\n" for n in range(900)),
        "questions": b"? " * 30_000,
        "many keys": b"".join(b"k%d: 1\n" % n for n in range(40_000)),
        "equal keys": b"a: 1\n" * 40_000,
        "documents": b"---\n" * 100_000,
        "tags": b"a: !!python/object/apply:os.system [true]\n",
        "a long number": b"schema_version: " + b"9" * 300_000 + b"\nblocks: []\n",
        "a long exponent": b"schema_version: 1e" + b"9" * 5000 + b"\nblocks: []\n",
        "a long word": b"name: " + b"x" * 900_000 + b"\nblocks: []\n",
        "digits and colons": b"a: " + b"1:" * 200_000 + b"1\n",
        "spaces": b"a:" + b" " * 900_000 + b"1\n",
        "directives": b"%YAML 1.2\n" * 20_000,
        "no end": b'a: "' + b"\\" * 900_000,
        "UTF-16": "blocks: []\n".encode("utf-16"),
        "nothing": b"",
    }


# --- tables -----------------------------------------------------------------------------------------------------------

_COMPARISONS = (
    b"winner,loser,count,observer,first\na,b,3,01,a\nb,a,1,01,b\nc,a,2,02,c\na,c,5,02,a\nb,c,4,01,c\nc,b,2,02,c\n",
    b"winner\tloser\noutcome\na\tb\twin\n",
    b'\xef\xbb\xbfwinner,loser,ties,group\r\na,b,3,s1\r\nb,a,1,s1\r\n"c, d",a,2,s2\r\na,"c, d",2,s2\r\n',
)


def _comparisons() -> Sequence[bytes]:
    return _COMPARISONS[::2]


def _read_comparisons(path: Path) -> object:
    from analysis.comparisons import read_any

    return read_any(path)


@cache
def _readings() -> tuple[bytes, ...]:
    """Return readings of a display as CSV."""
    rows = []
    levels = (0, 51, 102, 153, 204, 255)
    codes = [
        tuple(level * share for share in channel)
        for channel in ((1, 1, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1))
        for level in levels
    ]
    primaries = ((10.83, 5.62, 0.54), (9.67, 18.65, 1.63), (5.68, 2.20, 29.18))
    for index, code in enumerate(codes):
        shares = [(value / 255) ** 2.2 for value in code]
        light = [round(sum(s * p[k] for s, p in zip(shares, primaries, strict=True)) + 0.02, 4) for k in range(3)]
        rows.append((f"p{index}", *code, *light, index * 7.5, "left" if index % 2 else "both"))
    head = "# codes: 0..255\n# mode: side-by-side\n# instrument: one\n# panel: 1920x1080,0.2768,120,8\n"
    head += "# observer: CIE 1964 10\n"
    first = head + "name,red,green,blue,X,Y,Z,time_s,eye\n" + "".join(",".join(map(str, row)) + "\n" for row in rows)
    second = "R,G,B,X,Y,Z,area,surround_red,surround_green,surround_blue\n" + "".join(
        ",".join(map(str, (*row[1:7], *((0.25, 10, 20, 30) if number % 3 else ("", "", "", ""))))) + "\n"
        for number, row in enumerate(rows)
    )
    return first.encode(), ("# codes: 0..255\n" + second).encode()


@cache
def _ti3() -> tuple[bytes, ...]:
    from devices.readings import Measurements
    from devices.readings.csv_table import parse_csv
    from devices.readings.ti3 import format_ti3

    table = parse_csv(_readings()[0].decode().splitlines(), "readings.csv")
    waves = np.arange(380, 731, 10.0)
    spectra = np.outer(1e-3 * (1 + np.arange(5)), np.exp(-(((waves - 550) / 60) ** 2)))
    from devices.readings import xyz_from_spectra

    spectral = Measurements(np.eye(5)[:, :3], xyz_from_spectra(spectra, waves), spectra=spectra, wavelengths_nm=waves)
    calibrated = format_ti3(table).replace('Y_100 "NO"', 'Y_100 "YES"') + (
        '\nCAL\n\nDESCRIPTOR "x"\nDEVICE_CLASS "DISPLAY"\nCOLOR_REP "RGB"\nNUMBER_OF_FIELDS 4\nBEGIN_DATA_FORMAT\n'
        "RGB_I RGB_R RGB_G RGB_B\nEND_DATA_FORMAT\nNUMBER_OF_SETS 3\nBEGIN_DATA\n0 0 0 0\n"
        "0.5 0.4 0.5 0.6\n1 1 1 1\nEND_DATA\n"
    )
    return format_ti3(table).encode(), format_ti3(spectral).encode(), calibrated.encode()


def _read_readings(path: Path) -> object:
    from devices.readings import read_measurements

    return read_measurements(path)


# --- ICC profiles -----------------------------------------------------------------------------------------------------


@cache
def _profiles() -> tuple[bytes, ...]:
    from devices.display import read_display
    from extensions.profiles import profile_of_model

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "display.yaml")
        file.write_bytes(DISPLAY)
        model = read_display(file).models("side-by-side").left
    return (
        profile_of_model(model, "a display", kind="matrix").data,
        profile_of_model(model, "a display", kind="table", points=5).data,
    )


def _read_profile(path: Path) -> object:
    from devices.profiles import model_of_profile, read_profile
    from devices.readings import read_profile_measurements

    profile = read_profile(path)
    return read_profile_measurements(path, 100.0), None if profile.table_name else model_of_profile(profile, 100.0)


# --- Psychtoolbox -----------------------------------------------------------------------------------------------------


def _part(kind: int, body: bytes) -> bytes:
    return struct.pack("<II", kind, len(body)) + body + b"\0" * (-len(body) % 8)


def _matrix(kind: int, shape: tuple[int, ...], name: bytes, *parts: bytes) -> bytes:
    head = _part(6, struct.pack("<II", kind, 0)) + _part(5, struct.pack(f"<{len(shape)}i", *shape)) + _part(1, name)
    return _part(14, head + b"".join(parts))


def _doubles(values: object, name: bytes = b"") -> bytes:
    array = np.atleast_2d(np.asarray(values, dtype="<f8"))
    return _matrix(6, array.shape, name, _part(9, array.tobytes(order="F")))


def _struct(fields: Mapping[str, bytes], name: bytes = b"") -> bytes:
    names = b"".join(field.encode().ljust(32, b"\0") for field in fields)
    return _matrix(2, (1, 1), name, struct.pack("<HHi", 5, 4, 32), _part(1, names), *fields.values())


def _text(words: str) -> bytes:
    return _matrix(4, (1, len(words)), b"", _part(4, words.encode("utf-16-le")))


def mat_file(*variables: bytes) -> bytes:
    """Return a MAT-file of version 5 with ``variables``."""
    return b"MATLAB 5.0 MAT-file".ljust(116) + b"\0" * 8 + struct.pack("<H", 0x0100) + b"IM" + b"".join(variables)


def _compressed(variable: bytes) -> bytes:
    packed = zlib.compress(variable)
    return struct.pack("<II", 15, len(packed)) + packed


@cache
def _calibration() -> bytes:
    """Return the variable of a Psychtoolbox calibration: two of them, the second with spectra of 31 bands."""
    waves = 400 + 10 * np.arange(31)
    peaks = [1e-3 * np.exp(-(((waves - at) / 40) ** 2)) for at in (610, 540, 450)]
    levels = np.array([0.25, 0.5, 0.75, 1.0])
    mon = np.stack([np.concatenate([level**2.2 * peak for level in levels]) for peak in peaks], axis=1)
    raw = {"rawGammaInput": _doubles(levels[:, None]), "mon": _doubles(mon)}
    describe = {
        "S": _doubles([400, 10, 31]),
        "whichMeterType": _doubles(1),
        "comment": _text("a display"),
        "date": _text("1-Jan-2026"),
    }
    cal = {"describe": _struct(describe), "rawdata": _struct(raw), "S_device": _doubles([400, 10, 31])}
    cal["P_ambient"] = _doubles(np.full((31, 1), 1e-6))
    return _matrix(1, (1, 2), b"cals", _struct({"S_device": _doubles(0)}), _struct(cal))


def _mat() -> Sequence[bytes]:
    other = _doubles(np.zeros((3, 3)), b"other")
    return mat_file(_calibration()), mat_file(other, _compressed(_calibration()))


def _within_mat(change: Callable[[bytes], bytes], base: bytes, rng: random.Random) -> bytes:
    """Return a calibration that was changed before it was packed, of a size that fits or that does not."""
    changed = change(_calibration())
    return mat_file(_compressed(changed) if rng.random() < 0.7 else changed)


@cache
def _mat_bombs() -> dict[str, bytes]:
    many = 10**7
    zeros = b"\0" * many
    announced = struct.pack("<II", 14, 2**31 - 8) + _matrix(6, (10**4, 10**4), b"cals")[8:]
    cells = struct.pack("<II", 14, 0)
    return {
        "a bomb": mat_file(_compressed(announced + zeros)),
        "a bomb of zeros": mat_file(_compressed(zeros)),
        "a hundred bombs": mat_file(*[_compressed(_matrix(9, (many, 1), b"cals", _part(1, zeros)))] * 20),
        "bytes to doubles": mat_file(_compressed(_matrix(8, (many, 1), b"cals", _part(1, zeros)))),
        "in itself": mat_file(_compressed(_compressed(_compressed(_calibration())))),
        "structs": mat_file(
            _matrix(2, (2**31 - 1, 2**31 - 1), b"cals", struct.pack("<HHi", 5, 4, 8), _part(1, b"a".ljust(8, b"\0")))
        ),
        "structs without fields": mat_file(
            _matrix(2, (2**31 - 1, 2**31 - 1), b"cals", struct.pack("<HHi", 5, 4, 8), _part(1, b""))
        ),
        "cells": mat_file(_matrix(1, (90_000, 1), b"cals", cells * 90_000)),
        "too many cells": mat_file(_matrix(1, (2**31 - 1, 1), b"cals", cells * 90_000)),
        "nested": mat_file(_nested(2000)),
        "variables": mat_file(_doubles(1, b"cals") * 50_000),
        "no numbers": mat_file(_matrix(6, (0, *[2**31 - 1] * 31), b"cals", _part(9, b""))),
        "negative": mat_file(_matrix(6, (-1, -1), b"cals", _part(9, b"\0" * 8))),
        "version 7.3": b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + b"\0" * 384 + b"\x89HDF\r\n\x1a\n",
        "version 4": struct.pack("<5I", 0, 1, 1, 0, 5) + b"cals\0" + struct.pack("<d", 1),
        "nothing": b"",
    }


def _nested(depth: int) -> bytes:
    inner = _doubles(1)
    for level in range(depth):
        inner = _matrix(1, (1, 1), b"cals" if level == depth - 1 else b"", inner)
    return inner


# --- logs -------------------------------------------------------------------------------------------------------------


@cache
def _logs() -> tuple[bytes, ...]:
    """Return the log of a measurement, with checksums and as older versions wrote it."""
    from devices.readings import MeasurementLog, Reading, find_patches, step_facts, steps

    planned = steps(find_patches("grey"), 1)[:6]
    header = {
        "begun_utc": "2026-01-01T00:00:00+00:00", "instrument": "an instrument", "mode": "side-by-side", "eye": "both",
        "set": "grey", "set_source": "greys", "seed": 1, "highest_code": 255, "steps": step_facts(planned),
        "panel": "1920x1080,0.2768,120,8", "monitor_settings": '{"preset": "Standard"}',
    }  # fmt: skip
    waves = tuple(np.arange(380.0, 731.0, 50.0))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "m.jsonl")
        with MeasurementLog.create(file, header) as log:
            for step in planned:
                spectrum = tuple(0.1 * (step.position + 1) for _ in waves)
                log.keep(step, 10.0 * step.position, Reading((1.0 + step.position, 2.0, 3.0), spectrum, waves))
            log.fail(planned[0], 90.0, "too dark")
            log.note(resumed_utc="2026-01-01T00:10:00+00:00")
        chained = file.read_bytes()
    lines = [json.loads(line) for line in chained.splitlines()]
    plain = "".join(
        json.dumps({k: v for k, v in line.items() if k not in ("line", "chain", "chained")}) + "\n" for line in lines
    )
    return plain.encode(), plain.encode(), chained


# --- tables of colours and curves -------------------------------------------------------------------------------------

_SEEN = b"""\
# rgb: 0..16383
# observer: CIE 1931 2
R,G,B,X,Y,Z,name,time_s,f_number,iso
8000,7000,3000,19,20,11,straw,1/15,8,800
1000,2000,3000,4,5,6,blue,1/8,8,800
500,400,300,1.5,1.2,0.9,"brown, dark",0.5,8,800
"""
_REFERENCE = b"X,Y,Z,name\n85.5,90.0,74.3,white\n2.9,3.0,2.5,black\n"
_PATCHES = b"""\
# codes: 0..255
# source: made up
name,red,green,blue,area,surround_red,surround_green,surround_blue
white,255,255,255,,,,
black,0,0,0,0.5,10,20,30
grey,128,128,128,,,,
"""
_COLOURS = b"name,X,Y,Z\nwhite,19,20,21\ndark,1,2,3\n"
_CURVES = b"wavelength_nm,value,other\n" + b"".join(b"%d,%.3f,%.2f\n" % (w, w / 800, 0.5) for w in range(380, 781, 10))


def _read_seen(path: Path) -> object:
    from devices.camera import read_correspondences

    return read_correspondences(path)


def _read_reference(path: Path) -> object:
    from devices.camera import read_reference

    return read_reference(path)


def _read_patches(path: Path) -> object:
    from devices.readings.sets import read_patches

    return read_patches(path)


def _read_colours(path: Path) -> object:
    from extensions.profiles import read_colours

    return read_colours(path, "xyz", 255.0)


def _read_curves(path: Path) -> object:
    from stimuli.spectral.curves import read_illuminant, read_reflectances

    return read_illuminant(str(path), np.arange(400.0, 701.0)), read_reflectances(path)


def _shipped(name: str) -> bytes:
    return (ROOT / "configs" / f"{name}.yaml").read_bytes()


def _of(*bases: bytes) -> Callable[[], Sequence[bytes]]:
    return lambda: bases


FORMATS = (
    Format("experiment", ".yaml", _of(EXPERIMENT), _check, text=True, crafted=_bombs),
    Format("rig", ".yaml", _of(RIG), _check, text=True),
    Format("display", ".yaml", _of(DISPLAY, DISPLAY_2), _check, text=True),
    Format("recipe", ".yaml", _of(RECIPE), _check, text=True),
    Format("observers", ".yaml", _of(_shipped("observers/table_4_4")), _check, text=True),
    Format("camera", ".yaml", _of(_shipped("cameras/nikon_d800")), _check, text=True),
    Format("regions", ".yaml", _of(_shipped("regions/plate")), _check, text=True),
    Format("comparisons", ".csv", _comparisons, _read_comparisons, text=True),
    Format("readings", ".csv", _readings, _read_readings, text=True),
    Format("ti3", ".ti3", _ti3, _read_readings, text=True),
    Format("icc", ".icc", _profiles, _read_profile),
    Format("mat", ".mat", _mat, _read_readings, crafted=_mat_bombs, within=_within_mat),
    Format("log", ".jsonl", _logs, _read_readings, text=True),
    Format("correspondences", ".csv", _of(_SEEN), _read_seen, text=True),
    Format("reference", ".csv", _of(_REFERENCE), _read_reference, text=True),
    Format("patches", ".csv", _of(_PATCHES), _read_patches, text=True),
    Format("colours", ".csv", _of(_COLOURS), _read_colours, text=True),
    Format("curves", ".csv", _of(_CURVES), _read_curves, text=True),
)
