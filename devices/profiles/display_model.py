"""A profile's matrix and curves as a display model: exactly where a kind of curve is the same, else by a table.

A parametric curve of the kinds 0 to 2 is a curve of the GOGO family. A sampled curve that is a gamma within its own
rounding is taken for that gamma. Everything else becomes a table whose cubic, through √light, stays within the rounding
of the profile's numbers, or within a two-hundredth of a code of 8 bits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from devices.display import DisplayModel, TableCurve
from devices.display.curves import Curve, SrgbCurve
from devices.errors import DeviceError
from devices.profiles.curves import ROUNDING, TagCurve
from devices.profiles.profile import COLOURS, IccProfile, MatrixModel, black_beneath
from documents import Finding
from documents.arrays import Floats

# Of √light, a two-hundredth of a code of 8 bits.
_CLOSE = 2e-5
_MOST_KNOTS = 1024
_FIRST_KNOTS = 17
_PROBES = 4096
# Sampled curves may step back by this much: noise, which becomes flat.
_MOST_FALL = 2e-3
# By so much √light rises at least from entry to entry: flat stretches too, which a table cannot have.
_LEAST_RISE = 2e-9


@dataclass(frozen=True, slots=True, eq=False)
class ProfileModel:
    """The display ``model`` of a profile, and ``notes`` on how it came about, in sentences."""

    model: DisplayModel
    notes: tuple[str, ...]


def model_of_profile(profile: IccProfile, white_cd_m2: float | None = None) -> ProfileModel:
    """Return the matrix and curves of a profile as a display model.

    Parameters
    ----------
    profile
        A profile that `devices.profiles.read_profile` has read.
    white_cd_m2
        Luminance of the white in cd/m², above 0, in place of what the profile says of it.

    Returns
    -------
    ProfileModel
        The model, in cd/m².

    Raises
    ------
    DeviceError
        If the profile has no matrix and curves, or not all; if a curve falls; or if neither the profile nor
        ``white_cd_m2`` says how bright the white is.
    """
    matrix = profile.matrix
    if matrix is None:
        _ = profile.light
        what = f"the profile has a table ('{profile.table_name}') and no matrix and curves"
        raise DeviceError(Finding(what, profile.file, remedy="fit a model to what it gives, as display fit does"))
    luminance = profile.white_cd_m2(white_cd_m2)
    findings: list[Finding] = []
    curves, notes = display_curves(matrix, profile, findings)
    if findings:
        raise DeviceError(findings)
    if profile.table_name:
        notes.append(f"the profile's table ('{profile.table_name}') ranks above its matrix and curves, and may differ")
    primaries = profile.absolute(matrix.primaries.T, luminance).T
    black = np.zeros(3)
    if (beneath := black_beneath(profile, matrix)) is not None:
        notes.append("black is the profile's black point ('bkpt')")
        primaries = primaries * (1.0 - beneath[1])
        black = beneath * luminance
    # Light of code 0 belongs to black; a curve has none of its own.
    lifts = np.array([curve(0.0) if tone.tabled else curve.lift for curve, tone in curves])
    spans = np.array([curve(1.0) - curve(0.0) if tone.tabled else 1.0 for curve, tone in curves])
    black = black + primaries @ lifts
    table = profile.gamma_table
    if table is not None and not table.is_identity:
        words = f"the profile goes with a gamma table ('vcgt'), {table.sentence()}"
        notes.append(f"{words}; the model is right while that table is loaded")
    red, green, blue = (tone for _, tone in curves)
    model = DisplayModel(black, primaries * spans, (red, green, blue))
    if not model.xyz(np.zeros(3))[1] > 0:
        notes.append("code 0 gives no light; measure the black and write it into the file, for no display has none")
    return ProfileModel(model, (*notes, *profile.notes))


def display_curves(
    matrix: MatrixModel, profile: IccProfile, findings: list[Finding]
) -> tuple[list[tuple[TagCurve, Curve]], list[str]]:
    """Return each channel's curve in the profile and in the model, and how they differ; ``findings`` gets faults."""
    if all(is_srgb(curve) for curve in matrix.curves):
        return [(curve, SrgbCurve()) for curve in matrix.curves], ["the curves are that of sRGB, within their rounding"]
    tones: list[Curve | None] = [curve.exact() for curve in matrix.curves]
    # A display file has one kind of curve for all channels.
    tabled = any(tone is None for tone in tones)
    notes: dict[str, list[str]] = {}
    pairs: list[tuple[TagCurve, Curve]] = []
    for channel, (curve, tone) in enumerate(zip(matrix.curves, tones, strict=True)):
        name = f"{COLOURS[channel][0]}TRC"
        if tabled:
            try:
                tone, off = tabled_curve(curve)
            except ValueError as error:
                message = f"the curve '{name}' {error}"
                findings.append(Finding(message, profile.file, remedy="a curve that rises is needed; make it again"))
                continue
            words = f"a table of {len(tone.codes)} entries, within {255.0 * off:.1g} codes of 8 bits"
            notes.setdefault(words, []).append(name)
        elif tone is not None and curve.sampled:
            words = f"a gamma of {tone.numbers['gamma']:.6g}, which it is within its own rounding"
            notes.setdefault(words, []).append(name)
        assert tone is not None
        pairs.append((curve, tone))
    return pairs, [f"{', '.join(names)} became {words}" for words, names in notes.items()]


def is_srgb(curve: TagCurve) -> bool:
    """Whether ``curve`` is that of sRGB: sampled within its rounding, or a function of rounded numbers."""
    codes = curve.codes
    off = np.abs(curve(codes) - SrgbCurve().linear(codes)).max()
    return len(codes) > _FIRST_KNOTS and bool(off <= curve.rounding)


def tabled_curve(curve: TagCurve) -> tuple[TableCurve, float]:
    """Return a table of ``curve`` from 0 to 1, and by how much its codes differ at most, as a share of full drive.

    ValueError, to follow the curve's name, if the curve does not rise.
    """
    codes = curve.codes if curve.sampled else np.linspace(0.0, 1.0, _PROBES + 1)
    light = np.asarray(curve(codes), dtype=np.float64)
    risen = np.maximum.accumulate(light)
    fall = float((risen - light).max())
    if fall > _MOST_FALL:
        at = int(np.argmax(risen - light))
        raise ValueError(f"falls by {100 * fall:.2g} % of full light before code {255 * codes[at]:.4g} of 255")
    if risen[-1] - risen[0] < 0.5:
        raise ValueError(f"rises from {risen[0]:.3g} to {risen[-1]:.3g} only")
    root = np.sqrt((risen - risen[0]) / (risen[-1] - risen[0]))
    codes, root = _rising(codes, root)
    knots = np.unique(np.round(np.linspace(0, len(codes) - 1, _FIRST_KNOTS)).astype(int))
    while True:
        made = TableCurve(tuple(codes[knots].tolist()), tuple((root[knots] ** 2).tolist()))
        held = made.root(codes)[0]
        off = np.abs(held - root)
        off[np.abs(held**2 - root**2) <= ROUNDING] = 0.0
        if off.max() <= _CLOSE or len(knots) >= min(_MOST_KNOTS, len(codes)):
            return made, _codes_apart(made, codes, root)
        # In each piece that is off, the entry that is most so.
        piece = np.searchsorted(knots, np.arange(len(codes)), side="right") - 1
        order = np.lexsort((off, piece))
        worst = order[np.append(np.diff(piece[order]) > 0, True)]
        worst = worst[off[worst] > _CLOSE]
        worst = worst[np.argsort(-off[worst])][: _MOST_KNOTS - len(knots)]
        knots = np.union1d(knots, worst)


def _rising(codes: Floats, root: Floats) -> tuple[Floats, Floats]:
    """Return the entries (k,) that rise, k 3 or more: of a flat stretch the ends, the last a trace above the first.

    Where a curve begins flat its light is none up to there.
    """
    keep = np.ones(len(root), dtype=bool)
    keep[1:-1] = (np.diff(root)[:-1] > _LEAST_RISE) | (np.diff(root)[1:] > _LEAST_RISE)
    codes, root = codes[keep], root[keep].copy()
    for place in range(1, len(root)):
        root[place] = max(root[place], root[place - 1] + _LEAST_RISE)
    root = root / root[-1]
    if len(codes) < 3:
        return np.array([0.0, 0.5, 1.0]), np.interp([0.0, 0.5, 1.0], codes, root**2) ** 0.5
    return codes, root


def _codes_apart(made: TableCurve, codes: Floats, root: Floats) -> float:
    """Return by how much the codes for the light of ``codes`` differ from these at most, where light rises."""
    rise = np.gradient(root, codes)
    off = np.abs(made.root(codes)[0] - root) / np.maximum(rise, 0.1)
    return float(off.max())
