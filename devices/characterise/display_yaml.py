"""A fitted model as lines of a display file."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import yaml
from numpy.typing import ArrayLike

from devices.colour_matching import DEFAULT_OBSERVER
from devices.display.model import DisplayModel
from devices.display.model_spec import MixturesSpec
from devices.display.plvc import Plvc
from devices.display.srgb_curve import SrgbCurve
from devices.display.table_curve import TableCurve
from devices.display.tone_curve import ToneCurve

_COLOURS = ("red", "green", "blue")


def model_lines(model: DisplayModel, source: str, observer: str = DEFAULT_OBSERVER) -> list[str]:
    """Return the YAML lines of ``model``, not indented: black, primaries, curve, ``observer`` and ``source``."""
    lines = [f"black_XYZ_cd_m2: {_numbers(model.black_XYZ_cd_m2.tolist())}", "primaries_XYZ_cd_m2:"]
    for channel, colour in enumerate(_COLOURS):
        lines.append(f"  {colour + ':':6} {_numbers(model.primaries_XYZ_cd_m2[:, channel].tolist())}")
    lines.append("curve:")
    if all(isinstance(curve, TableCurve) for curve in model.curves):
        lines.append(f"  kind: {'plvc' if isinstance(model, Plvc) else 'table'}")
        for channel, (colour, curve) in enumerate(zip(_COLOURS, model.curves, strict=True)):
            if isinstance(curve, TableCurve):
                lines += [f"  {colour}:", f"    codes: {_numbers(curve.codes)}", f"    light: {_numbers(curve.light)}"]
            if isinstance(model, Plvc):
                rows = ", ".join(_numbers(row) for row in model.XYZ_per_light_cd_m2[channel].tolist())
                lines.append(f"    XYZ_per_light_cd_m2: [{rows}]")
        if isinstance(model, Plvc):
            lines.append("  mixtures_XYZ_cd_m2:")
            rows_of = zip(MixturesSpec.model_fields, model.mixtures_XYZ_cd_m2.tolist(), strict=True)
            lines += [f"    {name}: {_numbers(row)}" for name, row in rows_of]
            if model.residual is not None:
                lines += ["  residual:", f"    width: {_number(model.residual.width)}"]
                for name in ("knots", "XYZ_cd_m2"):
                    rows = ", ".join(_numbers(row) for row in getattr(model.residual, name).tolist())
                    lines.append(f"    {name}: [{rows}]")
    elif all(isinstance(curve, SrgbCurve) for curve in model.curves):
        lines.append("  kind: srgb")
    else:
        curves = [curve for curve in model.curves if isinstance(curve, ToneCurve)]
        lifted = any(curve.lift != 0 for curve in curves)
        plain = not lifted and all(curve.gain == 1 and curve.offset == 0 for curve in curves)
        lines.append(f"  kind: {'gamma' if plain else 'gogo' if lifted else 'gog'}")
        for colour, tone in zip(_COLOURS, curves, strict=True):
            rest = "" if plain else f"gain: {tone.gain!r}, offset: {_number(tone.offset)}, "
            lift = f", lift: {_number(tone.lift)}" if lifted else ""
            lines.append(f"  {colour + ':':6} {{{rest}gamma: {tone.gamma!r}{lift}}}")
    return [*lines, f"observer: {observer}", f"source: {quoted(source)}"]


def ambient_lines(ambient_XYZ_cd_m2: ArrayLike) -> list[str]:
    """Return the YAML line of the room's light, XYZ in cd/m², (3,)."""
    return [f"ambient_XYZ_cd_m2: {_numbers(np.asarray(ambient_XYZ_cd_m2, dtype=np.float64).tolist())}"]


def _numbers(values: Iterable[float]) -> str:
    return "[" + ", ".join(_number(value) for value in values) + "]"


def _number(value: float) -> str:
    # YAML reads 1e-05 as text: a number needs its point.
    text = f"{float(value):.10g}"
    return text.replace("e", ".0e") if "e" in text and "." not in text else text


def quoted(text: str) -> str:
    """Return ``text`` as a YAML scalar on one line."""
    dumped: str = yaml.safe_dump(
        text, default_style='"' if not text.isidentifier() else None, width=10**6, allow_unicode=True
    )
    return dumped.replace("\n...", "").strip()
