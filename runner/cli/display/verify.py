"""`cyclopean display verify`: fresh colours asked in XYZ, shown, measured, and how far off they are."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from runner.cli.display.measuring_options import instrument_options, show_options
from runner.cli.options import NOT_NEGATIVE
from runner.measuring.options import InstrumentOptions, ShowOptions

if TYPE_CHECKING:
    from runner.measuring.verification import Verdict


@click.command(short_help="Show new colours, read them, and report the colour error.")
@click.option(
    "--display", "display_file", type=click.Path(path_type=Path), required=True, help="Display file or rig file."
)
@click.option("--mode", help="Stereo mode to verify; a rig has its own.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Measurement file to write: NAME.jsonl.")
@click.option("--resume", is_flag=True, help="Resume a verification that stopped.")
@click.option(
    "--accept-gamma-table",
    is_flag=True,
    help="Verify although the graphics card's gamma table is not the measured one; the log states it.",
)
@click.option(
    "--limit",
    type=NOT_NEGATIVE,
    metavar="DELTA_E",
    help="Exit with status 1 if the mean ΔE00 is larger than this.",
)
@instrument_options
@show_options
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    display_file: Path,
    mode: str | None,
    output: Path | None,
    resume: bool,
    accept_gamma_table: bool,
    limit: float | None,
    instrument: InstrumentOptions,
    unattended: bool,
    show: ShowOptions,
    as_json: bool,
) -> None:
    """Show new colours, read them, and report the colour error.

    The 24 colours of the ColorChecker are asked in XYZ, adapted and scaled into the display's gamut, and shown as a
    session shows its pictures: by the same shader, with crosstalk cancelled and the panel evened out, undithered. The
    differences are in ΔE00 against the display's white. Beside them stands what the display file alone predicts of the
    codes shown.
    """
    from documents import WorkError
    from runner.cli.display.measuring_options import dialogue, raise_unless_complete
    from runner.measuring.verification import verify_display

    report = verify_display(
        display_file,
        instrument,
        show,
        mode=mode,
        output=output,
        resume=resume,
        accept_gamma_table=accept_gamma_table,
        dialogue=dialogue(show, unattended=unattended, quiet=as_json),
    )
    verdict = report.verdict
    if verdict is not None and as_json:
        passed = None if limit is None else verdict.achieved.mean <= limit
        click.echo(json.dumps({"measurement": str(report.file), "limit": limit, "passed": passed, **verdict.to_json()}))
    elif verdict is not None:
        click.echo(_in_words(verdict))
    raise_unless_complete(report.outcome, report.file)
    if verdict is not None and limit is not None and verdict.achieved.mean > limit:
        raise WorkError(f"the mean ΔE00 is {verdict.achieved.mean:.3f}, above the limit of {limit:g}")


def _in_words(verdict: Verdict) -> str:
    lines = [f"{'colour':<16}{'asked X Y Z':>26}{'measured X Y Z':>28}{'ΔE00':>8}{'model alone':>13}"]
    for colour in verdict.colours:
        asked, measured = (
            " ".join(f"{value:8.3f}" for value in XYZ) for XYZ in (colour.asked_XYZ_cd_m2, colour.measured_XYZ_cd_m2)
        )
        name = colour.name + ("*" if colour.desaturated else "")
        lines.append(f"{name:<16}{asked}  {measured}{colour.delta_e_00:8.3f}{colour.predicted_delta_e_00:13.3f}")
    if any(colour.desaturated for colour in verdict.colours):
        lines.append("* outside the display's gamut: asked less saturated")
    for name, spread in (("achieved", verdict.achieved), ("by the model alone", verdict.predicted)):
        lines.append(f"ΔE00 {name}: mean {spread.mean:.3f}, 95 % below {spread.p95:.3f}, largest {spread.largest:.3f}")
    return "\n".join(lines)
