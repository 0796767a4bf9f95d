"""`cyclopean display verify`: fresh colours asked in XYZ, shown, measured, and how far off they are."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from runner.cli.display.measuring_options import Reading, Showing, reading_options, showing_options

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
    "--limit",
    type=click.FloatRange(0),
    metavar="DELTA_E",
    help="Exit with status 1 if the mean ΔE00 is larger than this.",
)
@reading_options
@showing_options
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    display_file: Path,
    mode: str | None,
    output: Path | None,
    resume: bool,
    limit: float | None,
    reading: Reading,
    showing: Showing,
    as_json: bool,
) -> None:
    """Show new colours, read them, and report the colour error.

    The 24 colours of the ColorChecker are asked in XYZ, adapted and scaled into the display's gamut, and shown as a
    session shows its pictures: by the same shader, with crosstalk cancelled and the panel evened out, undithered. The
    differences are in ΔE00 against the display's white. Beside them stands what the display file alone predicts of the
    codes shown.
    """
    from devices.errors import MeasuringError
    from devices.patches.colorchecker import asked_of
    from documents import Finding
    from runner.cli.display.measuring_options import note, raise_unless_complete, talk, wiring_of
    from runner.cli.main import WorkError
    from runner.measuring.station import Order, characterised, check_eye, eye_model, measure, open_screen
    from runner.measuring.target import read_target
    from runner.measuring.verification import asked_XYZ, judge, patches_of

    target = read_target(display_file, mode)
    display = characterised(target)
    eye = showing.eye
    if eye == "both" and display.models.left is not display.models.right:
        what = f"the mode '{target.mode.name}' was characterised per eye"
        raise MeasuringError(Finding(what, str(display_file), remedy="verify one after the other: --eye left"))
    note(check_eye(target, eye))
    if target.mode.mixture(display.models) is not None:
        note(f"'{target.mode.name}' mixes both eyes' views into one picture: colours are as near as it comes to them")
    model = eye_model(display.models, eye)
    file = output or display_file.with_name(f"{display_file.stem}-{target.mode.name}-{eye}-verify.jsonl")
    asked = asked_of(model)
    facts = {"asked_XYZ_cd_m2": {colour.name: colour.XYZ_cd_m2.tolist() for colour in asked}}
    colours = (patches_of(asked, model),)
    order = Order(colours, eye, showing.seed, showing.repeat_every, showing.settle_s, facts=facts)
    wiring = wiring_of(target, showing, reading)
    wanted = asked_XYZ(asked, model)
    with open_screen(target, showing.backend, windowed=showing.windowed, asked=wanted) as screen:
        for warning in screen.surface.facts.remarks:
            click.echo(f"warning: {warning}", err=True)
        conversation = talk(showing, reading, quiet=as_json)
        outcome, session = measure(
            file, target, order, screen, reading.instrument, wiring, resume=resume, talk=conversation
        )
    if outcome.stopped or not session.readings:
        raise_unless_complete(outcome, file)
    verdict = judge(session, asked, display, eye)
    if as_json:
        passed = None if limit is None else verdict.achieved.mean <= limit
        click.echo(json.dumps({"measurement": str(file), "limit": limit, "passed": passed, **verdict.to_json()}))
    else:
        click.echo(_in_words(verdict))
    raise_unless_complete(outcome, file)
    if limit is not None and verdict.achieved.mean > limit:
        raise WorkError(f"the mean ΔE00 is {verdict.achieved.mean:.3f}, above the limit of {limit:g}")


def _in_words(verdict: Verdict) -> str:
    lines = [f"{'colour':<16}{'asked X Y Z':>26}{'measured X Y Z':>28}{'ΔE00':>8}{'model alone':>13}"]
    for one in verdict.colours:
        asked, measured = (
            " ".join(f"{value:8.3f}" for value in XYZ) for XYZ in (one.asked_XYZ_cd_m2, one.measured_XYZ_cd_m2)
        )
        name = one.name + ("*" if one.desaturated else "")
        lines.append(f"{name:<16}{asked}  {measured}{one.delta_e_00:8.3f}{one.predicted_delta_e_00:13.3f}")
    if any(one.desaturated for one in verdict.colours):
        lines.append("* outside the display's gamut: asked less saturated")
    for name, spread in (("achieved", verdict.achieved), ("by the model alone", verdict.predicted)):
        told = f"mean {spread.mean:.3f}, 95 % below {spread.p95:.3f}, largest {spread.largest:.3f}"
        lines.append(f"ΔE00 {name}: {told}")
    return "\n".join(lines)
