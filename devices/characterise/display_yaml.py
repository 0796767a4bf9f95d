"""A fitted model as a mode of a display file: a new file, or added to one whose other lines all stay."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import yaml

from devices.display import DisplayModel
from devices.display_file import read_display
from devices.errors import DeviceError
from devices.table_curve import TableCurve
from devices.tone_curve import ToneCurve
from documents import Finding

_COLOURS = ("red", "green", "blue")


def mode_lines(mode: str, models: Mapping[str, DisplayModel], sources: Mapping[str, str]) -> list[str]:
    """Return the YAML lines of one mode, indented by two blanks.

    ``models`` and ``sources`` have the key ``both``, or ``left`` and ``right``.
    """
    lines = [f"  {_text(mode)}:"]
    if set(models) == {"both"}:
        return lines + [f"    {line}" for line in _model_lines(models["both"], sources["both"])]
    for eye in ("left", "right"):
        lines += [f"    {eye}:", *(f"      {line}" for line in _model_lines(models[eye], sources[eye]))]
    return lines


def _model_lines(model: DisplayModel, source: str) -> list[str]:
    lines = [f"black_XYZ_cd_m2: {_numbers(model.black_XYZ_cd_m2.tolist())}", "primaries_XYZ_cd_m2:"]
    for channel, colour in enumerate(_COLOURS):
        lines.append(f"  {colour + ':':6} {_numbers(model.primaries_XYZ_cd_m2[:, channel].tolist())}")
    lines.append("curve:")
    if all(isinstance(curve, TableCurve) for curve in model.curves):
        lines.append("  kind: table")
        for colour, curve in zip(_COLOURS, model.curves, strict=True):
            if isinstance(curve, TableCurve):
                lines += [f"  {colour}:", f"    codes: {_numbers(curve.codes)}", f"    light: {_numbers(curve.light)}"]
    else:
        curves = [curve for curve in model.curves if isinstance(curve, ToneCurve)]
        plain = all(curve.gain == 1 and curve.offset == 0 for curve in curves)
        lines.append(f"  kind: {'gamma' if plain else 'gog'}")
        for colour, tone in zip(_COLOURS, curves, strict=True):
            rest = "" if plain else f"gain: {tone.gain!r}, offset: {_number(tone.offset)}, "
            lines.append(f"  {colour + ':':6} {{{rest}gamma: {tone.gamma!r}}}")
    return [*lines, f"source: {_text(source)}"]


def write_mode(
    path: Path,
    mode: str,
    models: Mapping[str, DisplayModel],
    sources: Mapping[str, str],
    panel: tuple[tuple[int, int], float, float, int] | None = None,
) -> str:
    """Write ``models`` as ``mode`` of the display file at ``path``; return in a sentence what was done.

    ``models`` and ``sources`` have the key ``both``, or ``left`` and ``right``. A file that is not there is made, and
    needs the ``panel``: resolution in pixels, pixel pitch in mm, refresh in hertz, bits. To one that is there the mode
    is added at the end of ``modes``; every other line, and every comment, stays. A mode that is there already is never
    overwritten.

    Raises
    ------
    DeviceError
        If the panel is needed and not given, the mode is there, one eye is alone, or the file's ``modes`` is not its
        last key, in plain lines.
    """
    if set(models) not in ({"both"}, {"left", "right"}):
        raise DeviceError(
            Finding(
                f"a mode of a display file holds both eyes, and only the {', '.join(models)} eye was fitted",
                str(path),
                remedy="give the readings of both in one file with the column 'eye'",
            )
        )
    added = mode_lines(mode, models, sources)
    if not path.exists():
        if panel is None:
            raise DeviceError(
                Finding(
                    "there is no such display file yet", str(path), remedy="a new one needs --panel 1920x1080,0.2768"
                )
            )
        (across, down), pitch, refresh, bits = panel
        head = [
            "schema_version: 1",
            f"panel: {{resolution_px: [{across}, {down}], pixel_pitch_mm: {pitch:g}, "
            f"refresh_hz: {refresh:g}, bits: {bits}}}",
            "modes:",
        ]
        text = "\n".join([*head, *added]) + "\n"
        done = f"wrote {path} with the mode '{mode}'"
    else:
        if mode in read_display(path).modes:
            raise DeviceError(
                Finding(
                    f"the mode '{mode}' is there already",
                    str(path),
                    remedy="take it out, give another --mode, or write a new file: nothing is overwritten",
                )
            )
        before = path.read_text(encoding="utf-8")
        text = _appended(before, added, path)
        done = f"added the mode '{mode}' at the end of {path}; all its other lines and comments stay"
    _check(text, path)
    temporary = path.with_name(path.name + ".part")
    temporary.write_text(text, encoding="utf-8")
    try:
        read_display(temporary)  # what does not read back is not put in place
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
    return done


def _appended(before: str, added: list[str], path: Path) -> str:
    lines = before.rstrip("\n").split("\n")
    keys = [line.split(":")[0] for line in lines if line[:1].strip() and not line.startswith("#")]
    inner = [line for line in lines if line.startswith("  ") and not line.lstrip().startswith("#")]
    if not keys or keys[-1] != "modes" or not any(line.rstrip().startswith("modes:") for line in lines):
        raise DeviceError(
            Finding(
                "'modes' is not the last key of the file", str(path), remedy="move it to the end, or write a new file"
            )
        )
    indents = {len(line) - len(line.lstrip()) for line in inner}
    if min(indents, default=2) != 2 or "\t" in before:
        raise DeviceError(
            Finding("the file is not indented by two blanks", str(path), remedy="indent it so, or write a new file")
        )
    return "\n".join([*lines, *added]) + "\n"


def _check(text: str, path: Path) -> None:
    try:
        yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise DeviceError(Finding("the mode cannot be added to the file as it is laid out", str(path))) from error


def _numbers(values: Iterable[float]) -> str:
    return "[" + ", ".join(_number(value) for value in values) + "]"


def _number(value: float) -> str:
    # YAML reads 1e-05 as text: a number needs its point.
    text = f"{float(value):.10g}"
    return text.replace("e", ".0e") if "e" in text and "." not in text else text


def _text(text: str) -> str:
    dumped: str = yaml.safe_dump(
        text, default_style='"' if not text.isidentifier() else None, width=10**6, allow_unicode=True
    )
    return dumped.replace("\n...", "").strip()
