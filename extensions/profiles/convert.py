"""Tables of colours converted by a display file, and the display written for other programs."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

from devices.display import Display, read_display
from devices.errors import DeviceError
from devices.readings import CIE_1931_2
from documents import Finding
from extensions.profiles.converted_table import Kind, convert_colours
from extensions.profiles.options import ConvertOptions


def convert_display(file: str | None, options: ConvertOptions, stream: BinaryIO) -> tuple[str, Sequence[str]]:
    """Convert a table of device codes to XYZ, or back; or write a display as an ICC profile or a .cube table.

    Parameters
    ----------
    file
        The table, or the display to write; None where it is ``stream``, or the display of the options.
    options
        The display file, its mode and eye, what to convert to, and what is written.
    stream
        The table, where no file is named.

    Returns
    -------
    A warning, empty if there is none, and the lines of the table, or sentences on the file that was written.

    Raises
    ------
    InputError
        If a file is wrong, the display is named twice or not at all, or what was asked for does not go together.
    WorkError
        If the file cannot be written.
    """
    to, named = options.to, options.display
    if to in ("icc", "cube"):
        if file is not None and named is not None:
            raise DeviceError(f"with --to {to}, name the display file once: as FILE or with --display")
        if named is None and file is None:
            raise DeviceError(f"name the display file: display convert DISPLAY.yaml --to {to}")
        return "", tuple(_written(named or Path(file or ""), options))
    if named is None:
        raise DeviceError(f"--to {to} needs --display DISPLAY.yaml")
    if options.output is not None or options.points is not None:
        raise DeviceError(f"--to {to} prints to standard output; -o and --points go with icc and cube")
    display = read_display(named)
    mode = options.mode or display.only_mode()
    model = display.models(mode).eye(options.eye)
    kind: Kind = "xyz" if to == "xyz" else "code"
    table = convert_colours(file or stream, model, kind, options.full, display.observer(mode))
    text = io.StringIO()
    table.write(text)
    outside = f"{table.outside} of {len(table.values)} colours lie outside the gamut" if table.outside else ""
    return outside, text.getvalue().splitlines()


def _written(named: Path, options: ConvertOptions) -> Iterator[str]:
    """Write the model of one mode and eye, and yield what there is to say of the file."""
    from extensions.profiles.cube import write_cube
    from extensions.profiles.write import write_profile

    display, eye, points = read_display(named), options.eye, options.points
    mode = options.mode or display.only_mode()
    models = display.models(mode)
    if display.observer(mode) != CIE_1931_2:
        what = f"the mode '{mode}' is for the observer {display.observer(mode)}"
        remedy = f"ICC and .cube know {CIE_1931_2} alone: fit the readings for it, into a mode of its own"
        raise DeviceError(Finding(what, str(named), remedy=remedy))
    path = options.output or named.with_suffix(f".{options.to}")
    words = f"{named.stem}, {mode}" + ("" if models.left is models.right else f", {eye} eye")
    if options.to == "icc":
        kind = None if options.profile_kind == "auto" else options.profile_kind
        table = display.gamma_table(mode, eye)
        made = write_profile(models.eye(eye), path, words, kind=kind, points=points, gamma_table=table)
        sentence, close = made.sentence(), made.close
    else:
        cube = write_cube(models.eye(eye), path, words, options.cube_input, points=points)
        sentence, close = cube.sentence(options.cube_input), True
    yield f"wrote {path}: {sentence}"
    if not close:
        yield "Note: people may see such differences; take more --points, up to 65, or --profile-kind auto."
    if models.left is not models.right:
        yield f"Note: it is of the {eye} eye; the other has a model of its own (--eye)."
    yield from _left_out(display, mode, options)


def _left_out(display: Display, mode: str, options: ConvertOptions) -> Iterator[str]:
    """Yield notes on what the display file has and the other file has not."""
    room_XYZ_cd_m2 = display.models(mode).eye(options.eye).ambient_XYZ_cd_m2
    if room_XYZ_cd_m2.any():
        room = f"the room's light, {float(room_XYZ_cd_m2[1]):.3g} cd/m², is left out"
        yield f"Note: it is of the display alone: {room}."
    if display.crosstalk(mode) is not None or display.gain_map(mode) is not None:
        yield "Note: crosstalk and the gain map of the display file have no place in it."
