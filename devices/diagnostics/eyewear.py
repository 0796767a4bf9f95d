"""The glasses: what they take of the light, and how much of one eye's picture the other eye sees.

The same patches read with and without glasses (thesis Figures 3.5 and 3.18) give what is lost. The stereo mode changes
the panel's own state too (shorter frames, a pulsed backlight), so that this is the loss of the glasses and the mode
together.

Crosstalk: a reading named ``black@other=red`` through the left lens had the left picture black and the right one red; a
plain reading through one lens had the other picture black.
"""

from __future__ import annotations

import numpy as np

from devices.compensation.crosstalk_fit import BLACK, CrosstalkFit, CrosstalkReading, EyeLeak, LeakShare, fit_crosstalk
from devices.diagnostics.diagnosis import Cell, Check, Colour, Diagnosis, PlotAxes, Readout, Trace, numbers
from devices.diagnostics.readings import FLOOR_SHARE, SAME_DIGITS, by_code, means, patch_name, tag, tagged
from devices.display.display_file import Eye
from devices.errors import DeviceError
from devices.readings import Measurements
from documents.arrays import Floats
from documents.yaml import yaml_lines

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
# Both eyes see the same picture, so that nobody wears glasses; or mirrors may separate the eyes, which pass most light.
_BARE = "flat"
_MIRRORS = frozenset({"side-by-side", "top-bottom", "dual-window"})
_NO_GLASSES = "The mode 'flat' needs no glasses, so that nothing is judged."
_PERHAPS_MIRRORS = (
    "That is right where mirrors separate the eyes. With glasses, they were missing or the files are swapped."
)


def glasses_transmittance(through: Measurements, without: Measurements) -> Diagnosis:
    """Judge the luminance of the brightest colour read in both, through the glasses, in % of that without.

    With spectra of both, the figure and table show the spectral transmittance where there is light enough. There is no
    verdict in the mode ``flat``, nor above the limit in a mode that mirrors may serve.
    """
    codes, seen, bare = _pairs(through, without)
    if not len(codes) or bare[:, 1].max() <= 0:
        return TRANSMITTANCE.unjudged("No colour was read both with and without glasses.")
    brightest = int(np.argmax(bare[:, 1]))
    value = float(100 * seen[brightest, 1] / bare[brightest, 1])
    code = " ".join(f"{255 * part:.0f}" for part in codes[brightest])
    words = f"At code {code} {seen[brightest, 1]:.4g} of {bare[brightest, 1]:.4g} cd/m² come through, {value:.3g} %."
    spectral = transmittance(through, without, tuple(float(part) for part in codes[brightest]))
    series: tuple[PlotAxes, ...] = ()
    if spectral is not None:
        waves, share = spectral
        peak = int(np.argmax(share))
        words += f" Spectral transmittance peaks at {100 * share[peak]:.3g} %, at {waves[peak]:.0f} nm."
        line = Trace("transmittance", numbers(waves), numbers(100 * share), "accent", "line")
        series = (PlotAxes("", "wavelength, nm", "transmittance, %", (line,)),)
    rows = tuple(
        (axis, float(bare[brightest, i]), float(seen[brightest, i]), _share(seen[brightest, i], bare[brightest, i]))
        for i, axis in enumerate("XYZ")
    )
    table = Readout(("", "without glasses", "through the glasses", "share, %"), rows)
    if through.mode == _BARE or (through.mode in _MIRRORS and value > (TRANSMITTANCE.limit or 0)):
        words += f" {_NO_GLASSES if through.mode == _BARE else _PERHAPS_MIRRORS}"
        return TRANSMITTANCE.described(value, words, series=series, table=table)
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
        PlotAxes(
            "greys",
            "code (0–255)",
            "luminance, cd/m²",
            (
                Trace("without glasses", level, numbers(bare), "soft", "line"),
                Trace("through the glasses", level, numbers(seen), "accent", "line"),
            ),
        ),
        PlotAxes(
            "share that comes through",
            "code (0–255)",
            "%",
            (Trace("share", numbers(255 * codes[bright, 0]), numbers(100 * share), "accent", "points"),),
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


CROSSTALK = Check(
    "crosstalk",
    "Crosstalk",
    5.0,
    "% of luminance",
    "Seuntiëns et al. [Seuntiens2005]: perceived distortion rises with leaks, and 5 % is the least that they tried; "
    "what was measured can be cancelled wherever the picture is not too dark",
)
_EYES: tuple[Eye, Eye] = ("left", "right")
_TINTS: tuple[tuple[Eye, Colour], ...] = (("left", "accent"), ("right", "ink"))


def crosstalk_readings(measurements: Measurements) -> tuple[CrosstalkReading, ...]:
    """Return what `fit_crosstalk` needs of ``measurements``; empty where no reading is named ``...@other=...``.

    Raises
    ------
    DeviceError
        If such a reading was through no single lens, or a name says black of another code, or black's code another
        colour.
    """
    if not tagged(measurements, "other"):
        return ()
    colours = {own.parts[0] for _, own in tagged(measurements, "other")}
    readings = []
    for row, name in enumerate(measurements.name):
        own_tag, eye = tag(name), measurements.eye[row]
        own = (own_tag.base if own_tag else patch_name(name)).strip().lower()
        other = own_tag.parts[0] if own_tag and own_tag.kind == "other" else BLACK
        if own_tag is None and (eye == "both" or own not in colours | {BLACK}):
            continue
        if own_tag is not None and own_tag.kind != "other":
            continue
        if eye == "both":
            raise DeviceError(f"the reading '{name}' is of crosstalk, but does not name the lens: eye is 'both'")
        if (own == BLACK) != bool(np.all(measurements.codes[row] == 0)):
            raise DeviceError(f"the reading '{name}' has the codes {measurements.codes[row].tolist()}: black is code 0")
        x, y, z = (float(value) for value in measurements.XYZ[row])
        left, right = (own, other) if eye == "left" else (other, own)
        readings.append(CrosstalkReading(eye, left, right, (x, y, z)))
    return tuple(readings)


def crosstalk(measurements: Measurements) -> Diagnosis:
    """Judge the largest share of luminance that leaks into an eye, in % of the colour that it leaks from.

    White is judged where it was read, otherwise every colour that was. A leak over a lit picture is judged where it is
    negative beyond the readings' noise [Baker2016]; otherwise those into black are. ``output`` is the `crosstalk:` of a
    display file.
    """
    try:
        readings = crosstalk_readings(measurements)
        if not readings:
            return CROSSTALK.unjudged(
                "Read each colour through each lens, then black with that colour in the other eye's picture, and name "
                "that reading black@other=white."
            )
        fit = fit_crosstalk(readings)
    except DeviceError as error:
        return CROSSTALK.unjudged(f"The crosstalk could not be fitted: {error.findings[0].message}.")
    leaks = _leaks(readings)
    if not leaks:
        return CROSSTALK.unjudged("Read each colour that leaks through the lens of its own eye too.")
    judged = {key: leak for key, leak in leaks.items() if key[1] == "white"} or leaks
    eye, colour = max(judged, key=lambda key: judged[key])
    value, words = max(0.0, judged[eye, colour]), ""
    words = f"Most leaks into the {eye} eye: {round(value, 4):.2g} % of {colour}'s luminance."
    taken = [leak for leak in fit.shares if leak.negative]
    if taken:
        most = min([leak for leak in taken if leak.other == "white"] or taken, key=lambda leak: leak.share)
        words += _negative_words(most, fit.left if most.eye == "left" else fit.right)
        value = max(value, -100.0 * most.share)
    rows: list[tuple[Cell, ...]] = []
    negative = {(leak.eye, leak.own, leak.other): 100.0 * leak.share for leak in taken if leak.own != BLACK}
    over_black = {(eye, BLACK, other): leak for (eye, other), leak in leaks.items()}
    for (seen_by, own, other), leak in (over_black | negative).items():
        eye_fit = fit.left if seen_by == "left" else fit.right
        rows.append(
            (
                seen_by,
                other,
                own,
                f"{round(leak, 3) + 0.0:.3f}",
                eye_fit.kind,
                float(eye_fit.readings),
                eye_fit.residual_max_cd_m2,
            )
        )
    names = list(dict.fromkeys(name for _, name in leaks))
    lines = tuple(
        Trace(
            f"{side} eye",
            numbers(names.index(name) + 1 for seen_by, name in leaks if seen_by == side),
            numbers(leak for (seen_by, _), leak in leaks.items() if seen_by == side),
            tint,
        )
        for side, tint in _TINTS
    )
    panel = PlotAxes(
        "", "colour in the other eye's picture", "leak, % of luminance", lines, (5.0,), x_names=tuple(names)
    )
    heads = ("into the eye", "colour", "over", "leak, %", "matrix", "readings", "largest residual, cd/m²")
    table = Readout(heads, tuple(rows))
    return CROSSTALK.judged(value, words, series=(panel,), table=table, output=crosstalk_yaml(fit))


def _negative_words(leak: LeakShare, fit: EyeLeak) -> str:
    """Say that an eye sees less of its own picture for the other's, and what becomes of it."""
    other = "right" if leak.eye == "left" else "left"
    over = "black" if leak.own == BLACK else leak.own
    words = (
        f" The {leak.eye} eye sees less of its own picture ({over}) while the {other} eye's is {leak.other}, by "
        f"{-100 * leak.share:.2g} ± {100 * leak.standard_error:.1g} % of {leak.other}'s luminance: negative crosstalk, "
        "as some LCD systems have it [Baker2016]. It is undone by adding light, where there is room below full drive."
    )
    if fit.over_black_left_out:
        words += " Readings over black, which has no light to take, were left out of the matrix."
    return words


def crosstalk_yaml(fit: CrosstalkFit) -> str:
    """Return the `crosstalk:` part of a display file."""
    # Adding 0 makes of -0 what is left when next to nothing leaks: 0.
    left, right = ((np.round(matrix, 6) + 0.0).tolist() for matrix in (fit.crosstalk.left, fit.crosstalk.right))
    kinds = f"left {fit.left.kind}, right {fit.right.kind}"
    source = f"least squares over {fit.left.readings} and {fit.right.readings} readings ({kinds})"
    return "\n".join(yaml_lines({"crosstalk": {"left": left, "right": right, "source": source}})) + "\n"


def _leaks(readings: tuple[CrosstalkReading, ...]) -> dict[tuple[Eye, str], float]:
    """Return for each eye and colour the luminance that leaks into black, in % of the eye's own light in it."""
    means: dict[tuple[Eye, str, str], float] = {}
    groups: dict[tuple[Eye, str, str], list[float]] = {}
    for reading in readings:
        groups.setdefault((reading.eye, reading.own, reading.other), []).append(reading.XYZ_cd_m2[1])
    means = {key: float(np.mean(values)) for key, values in groups.items()}
    leaks = {}
    for eye in _EYES:
        dark = means.get((eye, BLACK, BLACK))
        for (seen_by, own, other), leaked in means.items():
            alone = means.get((eye, other, BLACK))
            if seen_by == eye and own == BLACK and other != BLACK and dark is not None and alone and alone > dark:
                leaks[eye, other] = 100 * (leaked - dark) / (alone - dark)
    return leaks
