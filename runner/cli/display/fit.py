"""`cyclopean display fit`: measurements to a display model that predicts what it was not fitted to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from documents.text.words import counted

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from devices.characterise.choose import Characterisation
    from devices.characterise.measured_parts import MeasuredParts
    from devices.diagnostics.examine import MeasuredSet
    from devices.display.display_file import PanelSpec
    from devices.measurements import PatchEye


@click.command(name="fit")
@click.argument("file", metavar="FILE")
@click.option("--mode", help="Stereo mode of the readings. Default: the file's own.")
@click.option(
    "--eye",
    type=click.Choice(["both", "left", "right"]),
    default="both",
    show_default=True,
    help="Eye that the readings were taken for.",
)
@click.option(
    "--model",
    type=click.Choice(["auto", "gog", "gogo", "ggo", "gamma", "table", "plvc", "none"]),
    default="auto",
    show_default=True,
    help="Display model; auto takes the simplest that predicts held-out readings well, none fits none.",
)
@click.option("--without-glasses", metavar="FILE", help="Readings of the same patches without glasses.")
@click.option("--codes", "code_range", metavar="0..255", help="Range of the file's codes, if it does not say.")
@click.option("--seed", type=int, default=1, show_default=True, help="Random seed for the cross-validation folds.")
@click.option("-o", "--output", metavar="DISPLAY.yaml", help="Display file to create, or to write the mode into.")
@click.option(
    "--panel",
    metavar="WxH,PITCH_MM[,HZ[,BITS]]",
    help="Panel of a new display file, such as 1920x1080,0.2768,120,8. Default: the measured one.",
)
@click.option("--replace", is_flag=True, help="Overwrite an existing characterisation of the mode.")
@click.option("--brief", is_flag=True, help="Leave out the fits by the thesis's two methods.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    file: str,
    mode: str | None,
    eye: str,
    model: str,
    without_glasses: str | None,
    code_range: str | None,
    seed: int,
    output: str | None,
    panel: str | None,
    replace: bool,
    brief: bool,
    as_json: bool,
) -> None:
    """Fit display models to measurements and choose the one that predicts best.

    FILE is a table of measurements: CSV, ArgyllCMS .ti3, a Psychtoolbox calibration .mat, or the .jsonl of
    `display measure`. Every model is judged on readings that it was not fitted to. Where the file has readings of
    either eye, each is fitted by itself. Readings beside the other eye's picture, at places of a grid and without
    glasses (@ in their names) give crosstalk, a gain map, and what the glasses take.

    With -o the chosen model, crosstalk and gain map go into a mode of a display file. All else in the file stays, and
    what the mode holds already is only overwritten with --replace. With --eye, the mode gets that eye alone.
    """
    import json
    from pathlib import Path
    from typing import cast

    from devices.characterise.choose import Name, characterise
    from devices.characterise.measured_parts import measured_parts
    from devices.characterise.model_numbers import model_numbers
    from devices.diagnostics.examine import read_sets
    from devices.diagnostics.readings import plain
    from devices.measurements.table import PatchEye
    from runner.cli.display.fit_words import tell, tell_notes

    shape = _panel(panel) if panel else None
    measured, *bare = read_sets([Path(one) for one in (file, without_glasses) if one], code_range)
    readings = plain(measured.measurements)
    named = mode or readings.mode
    if output and not named:
        raise click.UsageError("the file does not name a mode; give --mode with -o")
    apart = {"left", "right"} <= set(readings.eye)
    eyes = [cast(PatchEye, one) for one in ([eye] if eye != "both" or not apart else ["left", "right"])]
    found = {
        one: characterise(
            readings if one == "both" else readings.for_eye(one),
            cast(Name, model),
            seed=seed,
        )
        for one in eyes
        if model != "none"
    }
    origin = Path(file).name + (f" by {readings.instrument}" if readings.instrument else "")
    parts = measured_parts(measured.measurements, origin, bare[0].measurements if bare else None, eyes)
    said = _left_out(measured, parts) + (_both_lit(parts) if found and "both" in readings.eye else [])
    told: dict[str, Any] = {"file": file, "mode": named, "parts": parts.to_json(), "said": said}
    for one, fitted in found.items():
        tables, why_none = _thesis(fitted)
        told[one] = {
            **fitted.to_json(),
            "numbers": model_numbers(fitted.chosen.model, fitted.chosen.standard_errors),
            "said": [*fitted.said, *([why_none] if why_none else [])],
            "thesis": tables,
        }
    if output:
        told["said"] += _one_for_both(set(readings.eye), eyes)
        if shape is None and readings.panel and not Path(output).exists():
            shape = _measured_panel(readings.panel, file)
            told["said"].append(f"the panel is the one that was measured: {shape.text}")
        told["written"] = _write(Path(output), named, found, parts, origin, shape, replace)
    if as_json:
        click.echo(json.dumps(told, indent=2, allow_nan=False, ensure_ascii=False))
        return
    for one in found:
        if one != "both":
            click.echo(f"{one.capitalize()} eye")
        tell(told[one], brief=brief)
    _tell_parts(parts)
    tell_notes(told["said"])
    if output:
        click.echo(told["written"])


def _left_out(measured: MeasuredSet, parts: MeasuredParts) -> list[str]:
    """Say what the tagged readings do not give, and how many were of no use."""
    from devices.diagnostics.readings import tag

    used = {"other", "place", "no-glasses"}
    tags = [found for name in measured.measurements.name if (found := tag(name)) is not None]
    unused = sum(found.kind not in used for found in tags)
    said = list(parts.said)
    if unused:
        said.append(
            f"{counted(unused, 'reading', 'readings')} at angles, on surrounds or while warming up (@ in the name) "
            f"{'was' if unused == 1 else 'were'} left out"
        )
    return said


def _both_lit(parts: MeasuredParts) -> list[str]:
    """Say that a model of readings with both eyes lit holds what leaked, where that is known to be something."""
    leak = next((one.value for one in parts.diagnoses if one.name == "crosstalk" and "crosstalk" in parts.lines), None)
    if not leak or leak <= 0:
        return []
    return [
        "if the other eye showed the patches too (display measure without --eye), each reading holds up to "
        f"{leak:.2g} % that leaked from it, and pictures whose crosstalk is cancelled come out so much too dark: "
        "measure with --eye left and --eye right"
    ]


def _one_for_both(read: set[PatchEye], eyes: list[PatchEye]) -> list[str]:
    """Say that one lens stands for both, where nobody chose that."""
    if eyes != ["both"] or len(read) != 1 or read == {"both"}:
        return []
    (lens,) = read
    return [f"the {lens} lens stands for both eyes in the display file; --eye {lens} writes that eye alone"]


def _tell_parts(parts: MeasuredParts) -> None:
    for one in parts.diagnoses:
        if one.value is not None:
            click.echo(f"{one.title}: {one.words}")
    for eye, found in parts.glasses.items():
        for one in found:
            click.echo(f"{one.title}{'' if eye == 'both' else f', {eye} eye'}: {one.words}")


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
    found: Mapping[PatchEye, Characterisation],
    parts: MeasuredParts,
    origin: str,
    shape: PanelSpec | None,
    replace: bool,
) -> str:
    from devices.characterise.display_yaml import model_lines
    from devices.characterise.mode_file import ModeLines, write_mode

    models: dict[str, list[str]] = {}
    for eye, fitted in found.items():
        errors = fitted.chosen.held_out
        source = (
            f"{fitted.chosen.name} fitted to {len(fitted.patches)} readings of {origin}; "
            f"held-out ΔE00 mean {errors.mean:.2f}, 95th percentile {errors.p95:.2f}, largest {errors.max:.2f}"
        )
        models[eye] = model_lines(fitted.chosen.model, source)
    if not models and not parts.lines:
        raise click.UsageError("--model none writes crosstalk or a gain map, and the readings give neither")
    return write_mode(path, mode, ModeLines(models, parts.lines), shape, replace=replace)


def _panel(text: str) -> PanelSpec:
    from devices.display.display_file import PanelSpec

    try:
        return PanelSpec.parse(text)
    except ValueError:
        raise click.UsageError(f"--panel is '{text}'; write it as 1920x1080,0.2768,120,8") from None


def _measured_panel(text: str, file: str) -> PanelSpec:
    """Return the panel that the readings in ``file`` are of, as they say."""
    from devices.display.display_file import PanelSpec
    from devices.errors import DeviceError
    from documents import Finding

    try:
        return PanelSpec.parse(text)
    except ValueError:
        remedy = "write it as 1920x1080,0.2768,120,8, or give --panel"
        raise DeviceError(Finding(f"the panel that was measured is '{text}'", file, remedy=remedy)) from None
