"""`cyclopean display verify`: fresh colours asked in XYZ, shown, measured, and how far off they are."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from runner.cli.display.measuring_options import EYES, instrument_options, showing_options

if TYPE_CHECKING:
    from runner.measuring.verification import Verdict


@click.command(short_help="Show fresh colours, read them, and say how far off they are.")
@click.option("--display", "display_file", type=click.Path(path_type=Path), required=True, help="A display file.")
@click.option("--mode", required=True, help="The stereo mode to verify.")
@click.option("--eye", type=click.Choice(EYES), default="both", show_default=True, help="The other eye sees black.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Where the readings go: NAME.jsonl.")
@click.option("--resume", is_flag=True, help="Go on with the verification that stopped.")
@click.option("--limit", type=click.FloatRange(0), metavar="DELTA_E", help="Exit with 1 if the mean ΔE00 is above it.")
@instrument_options
@showing_options
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    display_file: Path,
    mode: str,
    eye: str,
    output: Path | None,
    resume: bool,
    limit: float | None,
    instrument: str,
    port: str | None,
    instrument_options: tuple[str, ...],
    seed: int,
    repeat_every: int,
    settle_s: float,
    backend: str,
    windowed: bool,
    as_json: bool,
) -> None:
    """Show fresh colours, read them, and say how far off they are.

    The 24 colours of the ColorChecker are asked in XYZ, adapted and scaled into the display's gamut; the model in the
    display file says their codes. The differences are in ΔE00 against the display's white.
    """
    from devices.display_file import read_display
    from devices.patches.colorchecker import asked_of
    from documents import Finding
    from runner.cli.display.measuring_options import raise_unless_complete, talk, wiring_of
    from runner.cli.main import WorkError
    from runner.measuring.errors import MeasuringError
    from runner.measuring.station import Order, check_eye, eye_model, measure, open_screen
    from runner.measuring.target import read_target
    from runner.measuring.verification import judge, patches_of

    models = read_display(display_file).models(mode)
    if eye == "both" and models.left is not models.right:
        what = f"the mode '{mode}' was characterised per eye"
        raise MeasuringError(Finding(what, str(display_file), remedy="verify one after the other: --eye left"))
    model = eye_model(models, eye)
    target = read_target(display_file, mode)
    remark = check_eye(target, eye)
    if remark:
        click.echo(f"note: {remark}", err=True)
    file = output or display_file.with_name(f"{display_file.stem}-{mode}-{eye}-verify.jsonl")
    asked = asked_of(model)
    facts = {"asked_XYZ_cd_m2": {colour.name: colour.XYZ_cd_m2.tolist() for colour in asked}}
    order = Order(patches_of(asked, model), eye, seed, repeat_every, settle_s, facts=facts)
    wiring = wiring_of(target, eye, instrument, port, instrument_options, seed)
    with open_screen(target, backend, windowed=windowed) as screen:
        for warning in screen.surface.facts.remarks:
            click.echo(f"warning: {warning}", err=True)
        outcome, session = measure(file, target, order, screen, instrument, wiring, resume=resume, talk=talk(as_json))
    if outcome.stopped or not session.readings:
        raise_unless_complete(outcome, file)
    verdict = judge(session, asked, model)
    if as_json:
        passed = None if limit is None else verdict.mean <= limit
        click.echo(json.dumps({"measurement": str(file), "limit": limit, "passed": passed, **verdict.to_json()}))
    else:
        click.echo(_in_words(verdict))
    raise_unless_complete(outcome, file)
    if limit is not None and verdict.mean > limit:
        raise WorkError(f"the mean ΔE00 is {verdict.mean:.3f}, above the limit of {limit:g}")


def _in_words(verdict: Verdict) -> str:
    lines = [f"{'colour':<16}{'asked X Y Z':>26}{'measured X Y Z':>28}{'ΔE00':>8}"]
    for one in verdict.colours:
        asked, measured = (
            " ".join(f"{value:8.3f}" for value in XYZ) for XYZ in (one.asked_XYZ_cd_m2, one.measured_XYZ_cd_m2)
        )
        lines.append(f"{one.name + ('*' if one.desaturated else ''):<16}{asked}  {measured}{one.delta_e_00:8.3f}")
    if any(one.desaturated for one in verdict.colours):
        lines.append("* outside the display's gamut: asked less saturated")
    lines.append(f"ΔE00: mean {verdict.mean:.3f}, 95 % below {verdict.p95:.3f}, largest {verdict.largest:.3f}")
    return "\n".join(lines)
