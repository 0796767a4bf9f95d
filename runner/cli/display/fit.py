"""`cyclopean display fit`: measurements to a display model that predicts what it was not fitted to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from pathlib import Path

    from devices.characterise.choose import Characterisation
    from devices.display_file import PanelSpec


@click.command(name="fit")
@click.argument("file", metavar="FILE")
@click.option("--mode", help="Stereo mode that the readings are of.  [the file's own]")
@click.option("--eye", type=click.Choice(["both", "left", "right"]), default="both", show_default=True, help="Whose.")
@click.option(
    "--model",
    type=click.Choice(["auto", "gog", "gogo", "ggo", "gamma", "table", "plvc"]),
    default="auto",
    show_default=True,
    help="auto takes the simplest that predicts held-out readings well.",
)
@click.option("--codes", "code_range", metavar="0..255", help="Range of the file's codes, where it does not say.")
@click.option("--seed", type=int, default=1, show_default=True, help="Of the folds of the cross-validation.")
@click.option("-o", "--output", metavar="DISPLAY.yaml", help="Display file to make, or to add the mode to.")
@click.option(
    "--panel", metavar="WxH,PITCH_MM[,HZ[,BITS]]", help="Panel of a new display file, such as 1920x1080,0.2768,120,8."
)
@click.option("--replace", is_flag=True, help="Overwrite what the mode holds already.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")
def command(
    file: str,
    mode: str | None,
    eye: str,
    model: str,
    code_range: str | None,
    seed: int,
    output: str | None,
    panel: str | None,
    replace: bool,
    as_json: bool,
) -> None:
    """Fit display models to measurements and choose the one that predicts best.

    FILE is a table of measurements: CSV, ArgyllCMS .ti3, a Psychtoolbox calibration .mat, or the .jsonl of
    `display measure`. Every model is judged on readings that it was not fitted to. Where the file has readings of
    either eye, each is fitted by itself; readings at other places, angles or surrounds are left out.

    With -o the chosen model becomes a mode of a display file; a mode that is there is never overwritten.
    """
    import json
    from pathlib import Path
    from typing import cast

    from devices.characterise.choose import Name, characterise
    from devices.diagnostics.tags import plain
    from devices.measurements.table import PatchEye
    from runner.display_report.reading import read_sets

    shape = _panel(panel) if panel else None
    (measured,) = read_sets([Path(file)], code_range)
    readings = plain(measured.measurements)
    elsewhere = len(measured.measurements) - len(readings)
    named = mode or readings.mode
    if output and not named:
        raise click.UsageError("the file does not name a mode; give --mode with -o")
    apart = {"left", "right"} <= set(readings.eye)
    eyes = [eye] if eye != "both" or not apart else ["left", "right"]
    found = {
        one: characterise(
            readings if one == "both" else readings.for_eye(cast(PatchEye, one)),
            cast(Name, model),
            seed=seed,
        )
        for one in eyes
    }
    told: dict[str, Any] = {"file": file, "mode": named}
    for one, fitted in found.items():
        tables, why_none = _thesis(fitted)
        said = [*fitted.said, why_none] if why_none else list(fitted.said)
        if elsewhere:
            said.append(f"{elsewhere} readings at other places, angles or surrounds (@ in their names) were left out")
        told[one] = {**fitted.to_json(), "said": said, "thesis": tables}
    if output:
        told["written"] = _write(Path(output), named, found, Path(file), readings.instrument, shape, replace)
    if as_json:
        click.echo(json.dumps(told, indent=2, allow_nan=False, ensure_ascii=False))
        return
    for one in eyes:
        if one != "both":
            click.echo(f"{one.capitalize()} eye")
        _tell(told[one])
    if output:
        click.echo(told["written"])


def _thesis(found: Characterisation) -> tuple[dict[str, Any] | None, str]:
    from devices.characterise.thesis import thesis_fits
    from devices.errors import DeviceError

    try:
        return thesis_fits(found.patches.codes, found.patches.XYZ).to_json(), ""
    except DeviceError as error:
        return None, f"no tables by the thesis's methods: {error}"


def _write(
    path: Path,
    mode: str,
    found: dict[str, Characterisation],
    file: Path,
    instrument: str,
    shape: PanelSpec | None,
    replace: bool,
) -> str:
    from devices.characterise.display_yaml import model_lines
    from devices.characterise.mode_file import ModeLines, write_mode
    from devices.display import DisplayModel

    models: dict[str, list[str]] = {}
    for eye, fitted in found.items():
        errors = fitted.chosen.held_out
        assert isinstance(fitted.chosen.model, DisplayModel)
        source = (
            f"{fitted.chosen.name} fitted to {len(fitted.patches)} readings of {file.name}"
            + (f" by {instrument}" if instrument else "")
            + f"; held-out ΔE00 mean {errors.mean:.2f}, 95th percentile {errors.p95:.2f}, largest {errors.max:.2f}"
        )
        models[eye] = model_lines(fitted.chosen.model, source)
    return write_mode(path, mode, ModeLines(models, {}), shape, replace=replace)


def _panel(text: str) -> PanelSpec:
    from pydantic import ValidationError

    from devices.display_file import PanelSpec

    size, *rest = text.split(",")
    try:
        across, down = (int(part) for part in size.lower().split("x"))
        pitch = float(rest[0])
        refresh = float(rest[1]) if len(rest) > 1 else 60.0
        bits = int(rest[2]) if len(rest) > 2 else 8
        if len(rest) > 3:
            raise ValueError
        return PanelSpec(resolution_px=(across, down), pixel_pitch_mm=pitch, refresh_hz=refresh, bits=bits)
    except (ValueError, IndexError, ValidationError):
        raise click.UsageError(f"--panel is '{text}'; write it as 1920x1080,0.2768,120,8") from None


def _tell(told: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False)
    table = Table(
        title="Held-out ΔE00 (dark: its darkest third); table: the presenter's error in codes",
        title_justify="left",
        box=None,
    )
    for name in ("model", "numbers", "mean", "p95", "max", "dark", "fitted", "R²", "cond.", "table"):
        table.add_column(name, justify="left" if name == "model" else "right")
    for found in told["candidates"]:
        held = found["held_out_delta_e_2000"]
        off, condition = found["table_error_codes"], found["condition"]
        table.add_row(
            ("→ " if found["model"] == told["chosen"] else "  ") + found["model"],
            str(found["free_numbers"]),
            *(f"{held[key]:.2f}" for key in ("mean", "p95", "max", "dark_mean")),
            f"{found['fitted_delta_e_2000']['mean']:.2f}",
            f"{found['r2']['average']:.4f}",
            "–" if condition is None else f"{condition:.0f}",
            "–" if off is None else f"{off:.2g}",
        )
    console.print(table)
    click.echo(f"Chosen: {told['chosen']}, because {told['reason']}.")
    for found in told["candidates"]:
        if found["unusable"]:
            click.echo(f"{found['model']}: {found['unusable']}.")
        for name in found["at_bound"]:
            click.echo(f"{found['model']}: {name} ended at the edge of what is allowed.")
    click.echo("Where it errs: " + "; ".join(told["where_it_errs"]) + ".")
    for sentence in told["said"]:
        click.echo(f"Note: {sentence}.")
    if told["thesis"]:
        _tell_thesis(told["thesis"])


def _tell_thesis(tables: dict[str, Any]) -> None:
    click.echo("\nThe thesis's second method (code to light, each channel by itself):")
    for kind, channels in tables["method_2_light_from_code"].items():
        told = (
            f"{colour} gain {fit['gain']:.4f} offset {fit['offset']:.4f} gamma {fit['gamma']:.4f} "
            f"lift {fit['lift']:.4f} R² {fit['r2']:.4f}"
            for colour, fit in channels.items()
        )
        click.echo(f"  {kind:5} " + "; ".join(told))
    click.echo("Its first method, average R² over X, Y and Z (XYZ from code; code from XYZ):")
    back = {(row["model"], row["channel"]): row["average"] for row in tables["method_1_code_from_XYZ_r2"]}
    for row in tables["method_1_XYZ_from_code_r2"]:
        there, here = row["average"], back[row["model"], row["channel"]]
        shown = ("–" if value is None else f"{value:.4f}" for value in (there, here))
        click.echo(f"  {row['model']:5} {row['channel']:5} " + "  ".join(shown))
