"""`cyclopean display convert`: device codes to XYZ, or back, by a display file."""

from __future__ import annotations

import click


@click.command(name="convert")
@click.option("--display", "display_file", required=True, metavar="DISPLAY.yaml", help="Display file.")
@click.option("--mode", required=True, help="Stereo mode of the display file.")
@click.option("--eye", type=click.Choice(["left", "right"]), default="left", show_default=True)
@click.option("--to", "target", type=click.Choice(["code", "xyz"]), required=True)
@click.option(
    "--full", type=click.FloatRange(min=0, min_open=True), default=255.0, show_default=True, help="Full drive."
)
def command(display_file: str, mode: str, eye: str, target: str, full: float) -> None:
    """Convert a table of device codes to XYZ, or back.

    Reads CSV from standard input and writes CSV to standard output: the columns red,green,blue, in 0..255 or up to
    --full, become X,Y,Z in cd/m², or the other way about. Codes are not rounded. Colours outside the gamut become
    the nearest codes channel by channel; how many there were is told on the error stream.
    """
    import csv
    import io
    import sys
    from pathlib import Path
    from typing import cast

    import numpy as np

    from devices.display_file import Eye, read_display
    from devices.errors import DeviceError
    from documents import Finding

    model = read_display(Path(display_file)).models(mode).eye(cast(Eye, eye))
    given, wanted = (
        (("X", "Y", "Z"), ("red", "green", "blue")) if target == "code" else (("red", "green", "blue"), ("X", "Y", "Z"))
    )
    file = "standard input"
    try:
        text = io.TextIOWrapper(sys.stdin.buffer, encoding="utf-8-sig", newline="").read()
        rows = [
            (n, r)
            for n, r in enumerate(csv.reader(text.splitlines(), strict=True), 1)
            if r and not r[0].startswith("#")
        ]
    except (UnicodeDecodeError, csv.Error) as error:
        raise DeviceError(Finding(f"the table is not CSV in UTF-8: {error}", file)) from error
    head = [cell.strip() for cell in rows[0][1]] if rows else []
    missing = [name for name in given if name not in head]
    if missing:
        raise DeviceError(
            Finding(f"the header has no {', '.join(missing)}", file, remedy=f"columns: {','.join(given)}")
        )
    values = np.empty((len(rows) - 1, 3))
    findings: list[Finding] = []
    top = full if target == "xyz" else float("inf")
    for index, (line, cells) in enumerate(rows[1:]):
        for place, name in enumerate(given):
            cell = cells[head.index(name)] if len(cells) == len(head) else ""
            try:
                values[index, place] = float(cell)
            except ValueError:
                values[index, place] = np.nan
            value = values[index, place]
            if not np.isfinite(value) or (target == "xyz" and not 0 <= value <= top):
                wish = f"a number in 0..{full:g}" if target == "xyz" else "a finite number"
                findings.append(Finding(f"{name} is '{cell}'", file, line, head.index(name) + 1, f"{wish} is needed"))
    if findings:
        raise DeviceError(findings[:20])
    if target == "code":
        outside = model.clipping(values).any_channel
        found = model.code(values) * full
        if outside:
            click.echo(f"cyclopean: {outside} of {len(values)} colours lie outside the gamut", err=True)
    else:
        found = model.xyz(values / full)
    others = [name for name in head if name not in given and name not in wanted]
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow([*others, *wanted])
    for (_, cells), row in zip(rows[1:], found, strict=True):
        writer.writerow([*(cells[head.index(name)] for name in others), *(f"{value:.10g}" for value in row)])
