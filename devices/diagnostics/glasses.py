"""What the glasses take: the same patches read with and without them (thesis Figures 3.5 and 3.18).

The stereo mode changes the panel's own state too (shorter frames, a pulsed backlight), so that what is lost is the
glasses' and the mode's together.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.diagnostics.diagnosis import Check, Diagnosis, Line, Panel, Table, numbers
from devices.diagnostics.ramps import FLOOR_SHARE, SAME_DIGITS, by_code, means
from devices.measurements import Measurements

Floats = NDArray[np.float64]

TRANSMITTANCE = Check(
    "glasses_transmittance",
    "Transmittance of the glasses",
    50.0,
    "% of luminance",
    "physics: an eye behind a polariser or a shutter gets at most half; more, and the files are swapped or the glasses "
    "were missing (the thesis's pass 15 % at their peak, Figure 3.18)",
)
LOSS = Check(
    "luminance_loss",
    "Evenness of the luminance loss",
    10.0,
    "% from the median",
    "this project: a filter takes the same share of every colour's light, but tints them: 10 % over greys; more is a "
    "mode that changes the tone curve, so that a model measured without glasses cannot be scaled",
)
_FEWEST = 3


def glasses_transmittance(through: Measurements, without: Measurements) -> Diagnosis:
    """Judge the luminance of the brightest colour read in both, through the glasses, in % of that without.

    With spectra of both, the figure and table show the spectral transmittance where there is light to tell.
    """
    codes, seen, bare = _pairs(through, without)
    if not len(codes) or bare[:, 1].max() <= 0:
        return TRANSMITTANCE.unjudged("No colour was read both with and without glasses.")
    brightest = int(np.argmax(bare[:, 1]))
    value = float(100 * seen[brightest, 1] / bare[brightest, 1])
    code = " ".join(f"{255 * part:.0f}" for part in codes[brightest])
    words = f"At code {code} {seen[brightest, 1]:.4g} of {bare[brightest, 1]:.4g} cd/m² come through, {value:.3g} %."
    spectral = transmittance(through, without, tuple(float(part) for part in codes[brightest]))
    series: tuple[Panel, ...] = ()
    if spectral is not None:
        waves, share = spectral
        peak = int(np.argmax(share))
        words += f" Spectral transmittance peaks at {100 * share[peak]:.3g} %, at {waves[peak]:.0f} nm."
        line = Line("transmittance", numbers(waves), numbers(100 * share), "accent", "line")
        series = (Panel("", "wavelength, nm", "transmittance, %", (line,)),)
    rows = tuple(
        (axis, float(bare[brightest, i]), float(seen[brightest, i]), _share(seen[brightest, i], bare[brightest, i]))
        for i, axis in enumerate("XYZ")
    )
    table = Table(("", "without glasses", "through the glasses", "share, %"), rows)
    return TRANSMITTANCE.judged(value, words, series=series, table=table)


def transmittance(
    through: Measurements, without: Measurements, code: tuple[float, ...]
) -> tuple[Floats, Floats] | None:
    """Return wavelengths (m,) in nm and the share (m,) of light at ``code`` that comes through; None without spectra.

    Only wavelengths at which the display gives at least 1 % of its peak are kept. Where the two were read at different
    wavelengths, those of the coarser count, and the finer is interpolated.
    """
    parts = (through.spectra, through.wavelengths_nm, without.spectra, without.wavelengths_nm)
    spectra, waves, bare_spectra, bare_waves = parts
    if spectra is None or waves is None or bare_spectra is None or bare_waves is None:
        return None
    code = tuple(round(part, SAME_DIGITS) for part in code)
    rows, bare_rows = by_code(through).get(code), by_code(without).get(code)
    if not rows or not bare_rows:
        return None
    at = waves if len(waves) < len(bare_waves) else bare_waves
    seen = np.interp(at, waves, spectra[rows].mean(axis=0), left=np.nan, right=np.nan)
    bare = np.interp(at, bare_waves, bare_spectra[bare_rows].mean(axis=0), left=np.nan, right=np.nan)
    lit = np.isfinite(seen) & (bare > 0) & (bare >= 0.01 * np.nanmax(bare, initial=0.0))
    return (at[lit], np.asarray(seen[lit] / bare[lit])) if lit.any() else None


def luminance_loss(through: Measurements, without: Measurements) -> Diagnosis:
    """Judge how far the share of luminance that comes through strays over the greys, in % of its median.

    Greys with less than 2 % of the brightest one's light are drawn but not judged.
    """
    codes, seen, bare = _pairs(through, without)
    grey = np.all(codes == codes[:, :1], axis=1) & (codes[:, 0] > 0)
    order = np.flatnonzero(grey)[np.argsort(codes[grey, 0])]
    codes, seen, bare = codes[order], seen[order, 1], bare[order, 1]
    bright = bare > FLOOR_SHARE * bare.max(initial=0)
    if bright.sum() < _FEWEST:
        return LOSS.unjudged("Read at least three greys both with and without glasses.")
    share = seen[bright] / bare[bright]
    median = float(np.median(share))
    if median <= 0:
        return LOSS.unjudged("No light comes through the glasses.")
    value = float(100 * np.abs(share / median - 1).max())
    level = numbers(255 * codes[:, 0])
    panels = (
        Panel(
            "greys",
            "code (0–255)",
            "luminance, cd/m²",
            (
                Line("without glasses", level, numbers(bare), "soft", "line"),
                Line("through the glasses", level, numbers(seen), "accent", "line"),
            ),
        ),
        Panel(
            "share that comes through",
            "code (0–255)",
            "%",
            (Line("share", numbers(255 * codes[bright, 0]), numbers(100 * share), "accent", "points"),),
            (90 * median, 110 * median),
        ),
    )
    words = (
        f"Of the greys' luminance {100 * median:.3g} % comes through, {100 - 100 * median:.3g} % is lost; single greys "
        f"stray by up to {value:.2g} % of that share."
    )
    return LOSS.judged(value, words, series=panels)


def _share(seen: float, bare: float) -> float | None:
    return float(100 * seen / bare) if bare > 0 else None


def _pairs(through: Measurements, without: Measurements) -> tuple[Floats, Floats, Floats]:
    """Return the codes (k, 3) read in both, and their mean XYZ (k, 3) through the glasses and without."""
    codes, light = means(through)
    bare = dict(zip(_keys(means(without)[0]), means(without)[1], strict=True))
    rows = [row for row, code in enumerate(_keys(codes)) if code in bare]
    others = np.array([bare[code] for code in _keys(codes[rows])]).reshape(-1, 3)
    return codes[rows].reshape(-1, 3), light[rows].reshape(-1, 3), others


def _keys(codes: Floats) -> list[tuple[float, ...]]:
    return [tuple(code) for code in np.round(codes, SAME_DIGITS).tolist()]
