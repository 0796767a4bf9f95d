"""`cyclopean display fit`: measurements to a display model that predicts what it was not fitted to."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from runner.cli.options import POSITIVE, SEED

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import numpy as np
    from numpy.typing import NDArray
    from rich.console import Console

    from devices.characterise import Candidate, Estimate, EyeFit, MeasuredParts, ModelNumbers, ProfileMode, ThesisFits
    from devices.display import PanelSpec
    from devices.readings import PatchEye

    Floats = NDArray[np.float64]


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
    type=click.Choice(["auto", "gog", "gogo", "ggo", "gamma", "table", "plvc", "residual", "none"]),
    default="auto",
    show_default=True,
    help="Display model; auto takes the simplest that predicts held-out readings well, none fits none.",
)
@click.option("--without-glasses", metavar="FILE", help="Readings of the same patches without glasses.")
@click.option("--observer", metavar="NAME", help="Colorimetric observer, if not the readings' own: CIE 2015 10, …")
@click.option("--codes", "code_range", metavar="0..255", help="Range of the file's codes, if it does not state it.")
@click.option(
    "--white-cd-m2",
    type=POSITIVE,
    metavar="CD_M2",
    help="Luminance of the white, of an ICC profile that does not say it.",
)
@click.option("--seed", type=SEED, default=1, show_default=True, help="Random seed for the cross-validation folds.")
@click.option("--keep-all", is_flag=True, help="Leave no reading out, even one that disagrees with all others.")
@click.option("--no-drift-correction", is_flag=True, help="Keep the readings where repeated patches show a drift.")
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
    observer: str | None,
    code_range: str | None,
    white_cd_m2: float | None,
    seed: int,
    keep_all: bool,
    no_drift_correction: bool,
    output: str | None,
    panel: str | None,
    replace: bool,
    brief: bool,
    as_json: bool,
) -> None:
    """Fit display models to measurements and choose the one that predicts best.

    FILE is a table of measurements: CSV, ArgyllCMS .ti3, a Psychtoolbox calibration .mat, the .jsonl of
    `display measure`, or an ICC profile. Every model is judged on readings that it was not fitted to. Where the file
    has readings of either eye, each is fitted by itself. Where patches that were read again show that the light drifted
    during the run, the readings are brought to its end. Readings beside the other eye's picture, at places of a grid
    and without glasses (@ in their names) give crosstalk, a gain map, and what the glasses take.

    Of an ICC profile without measurements inside, the table is asked for colours, which are fitted. Its matrix and
    curves are taken as they are, unless --model names another model.

    With -o the chosen model, crosstalk and gain map go into a mode of a display file. All else in the file stays, and
    what the mode has already is overwritten only with --replace. With --eye, the mode gets that eye alone.
    """
    import json
    from pathlib import Path
    from typing import Literal, cast

    from devices.characterise import Name, fit_display, read_profile_mode
    from devices.diagnostics import plain, read_sets
    from devices.readings import CIE_1931_2, PatchEye
    from runner.cli.display.measuring_options import panel_of

    shape = panel_of(panel) if panel else None
    alone = model == "auto" and without_glasses is None and observer in (None, CIE_1931_2)
    stated = read_profile_mode(file, white_cd_m2) if alone else None
    if stated is not None:
        _stated(stated, output, mode, cast(PatchEye, eye), shape, replace=replace, as_json=as_json)
        return
    files = [Path(path) for path in (file, without_glasses) if path]
    measured, *bare = read_sets(files, code_range, None, white_cd_m2=white_cd_m2)
    readings = plain(measured.measurements)
    _require_for_writing(output, mode or readings.mode, panel or readings.panel)
    fit = fit_display(
        measured.measurements,
        model=cast(Name | Literal["auto", "none"], model),
        eye=cast(PatchEye, eye),
        mode=mode,
        without_glasses=bare[0].measurements if bare else None,
        seed=seed,
        keep_all=keep_all,
        file=file,
        observer=observer,
        correct_drift=not no_drift_correction,
    )
    if output and not fit.eyes and not fit.has_parts:
        raise click.UsageError("--model none writes crosstalk, a gain map or the room's light; the readings give none")
    written = fit.write(output, shape, replace=replace) if output else None
    notes = [*fit.notes, *(written.notes if written else ())]
    if as_json:
        result = {"file": file, **fit.to_json(), "said": notes} | ({"written": written.words} if written else {})
        click.echo(json.dumps(result, indent=2, allow_nan=False))
        return
    if fit.eyes:
        click.echo(f"Colorimetric observer: {fit.observer}°")
    for each, eye_fit in fit.eyes.items():
        if each != "both":
            click.echo(f"{each.capitalize()} eye")
        _print_eye(eye_fit, brief=brief)
    _print_parts(fit.parts)
    _print_notes(notes)
    if written:
        click.echo(written.words)


def _require_for_writing(output: str | None, mode: str | None, panel: object) -> None:
    """Refuse at once, before anything is fitted, what would be missing for the display file ``output``."""
    from pathlib import Path

    missing: list[str] = []
    if output and not mode:
        missing.append("the measurements do not name a mode; give --mode with -o")
    if output and not panel and not Path(output).exists():
        missing.append(f"there is no display file {output} yet; a new one needs --panel 1920x1080,0.2768")
    if missing:
        raise click.UsageError("; and ".join(missing))


def _stated(
    stated: ProfileMode,
    output: str | None,
    mode: str | None,
    eye: PatchEye,
    panel: PanelSpec | None,
    *,
    replace: bool,
    as_json: bool,
) -> None:
    """Print and write what a profile states by matrix and curves."""
    import json

    from documents.text import clean_console

    _require_for_writing(output, mode, panel)
    written = stated.write(output, mode, panel, eye=eye, replace=replace) if output and mode else None
    if as_json:
        result = {"file": stated.file, "mode": mode, eye: stated.to_json()} | ({"written": written} if written else {})
        click.echo(json.dumps(result, indent=2, allow_nan=False))
        return
    white = " ".join(f"{value:.4g}" for value in stated.white_XYZ_cd_m2)
    click.echo(f"The profile's matrix and curves, as they are ({stated.kind}); its white: {white} cd/m²")
    _print_numbers(stated.numbers, clean_console())
    _print_black(stated.numbers, None)
    _print_notes([*stated.notes, "nothing in the profile says how well it describes the display: display verify does"])
    if written:
        click.echo(written)


def _print_eye(fit: EyeFit, *, brief: bool) -> None:
    """Print the thesis's tables unless ``brief``, every candidate, the chosen one's numbers, and where it errs."""
    from documents.text import clean_console

    console = clean_console()
    characterisation = fit.characterisation
    if fit.thesis and not brief:
        _print_thesis(fit.thesis, console)
    _print_candidates(characterisation.candidates, characterisation.chosen.name, console)
    click.echo(f"Chosen: {characterisation.chosen.name}, because {characterisation.reason}.")
    _print_numbers(characterisation.chosen.numbers, console)
    _print_black(characterisation.chosen.numbers, characterisation.patches.black_read)
    for candidate in characterisation.candidates:
        if candidate.unusable:
            click.echo(f"{candidate.name}: {candidate.unusable}.")
        for name in candidate.at_bound:
            click.echo(f"{candidate.name}: {name} ended at the edge of what is allowed.")
    click.echo("Where it errs:")
    for sentence in characterisation.where_it_errs:
        click.echo(f"  {sentence}")
    _print_notes(fit.notes)


def _print_notes(sentences: Iterable[str]) -> None:
    """Print each sentence as a note, closed by one full stop or its question mark."""
    for sentence in sentences:
        click.echo(f"Note: {sentence}" if sentence.endswith((".", "?")) else f"Note: {sentence}.")


def _print_parts(parts: MeasuredParts) -> None:
    for diagnosis in parts.diagnoses:
        if diagnosis.value is not None:
            click.echo(f"{diagnosis.title}: {diagnosis.words}")
    for eye, diagnoses in parts.glasses.items():
        for diagnosis in diagnoses:
            click.echo(f"{diagnosis.title}{'' if eye == 'both' else f', {eye} eye'}: {diagnosis.words}")


def _print_table(
    title: str, columns: Sequence[str], rows: Iterable[Sequence[str]], console: Console, words: int = 1
) -> None:
    """Print a table whose first ``words`` columns are text; of several, the first stands only where it changes."""
    from documents.pages import Table, print_blocks

    shown, before = [], ""
    for row in rows:
        shown.append(["" if words > 1 and row[0] == before else row[0], *row[1:]])
        before = row[0]
    print_blocks([Table.of_texts(title, columns, shown, range(words))], console)


def _print_candidates(candidates: Sequence[Candidate], chosen: str, console: Console) -> None:
    rows = []
    for candidate in candidates:
        held = candidate.held_out
        rows.append(
            [
                ("→ " if candidate.name == chosen else "  ") + candidate.name,
                str(candidate.free_numbers),
                *(f"{value:.2f}" for value in (held.mean, held.p95, held.max)),
                "–" if candidate.worst_light is None else candidate.worst_light.size,
                f"{candidate.fitted.mean:.2f}",
                _number(candidate.r2_average),
                _number(candidate.condition, ".0f"),
                _number(candidate.inversion_error_codes, ".1g"),
                _number(candidate.table_error_codes, ".1g"),
            ]
        )
    columns = ("model", "free", "mean", "p95", "max", "light", "fit", "R²", "cond.", "inv.", "table")
    title = (
        "Held-out ΔE00 (light: by how much luminance is off in the worst decade; inv. and table: errors of the inverse "
        "and of the presenter's table in 8-bit codes)"
    )
    _print_table(title, columns, rows, console)


def _print_numbers(numbers: ModelNumbers, console: Console) -> None:
    """Print the chosen model's curves with their standard errors, where the fit gives them."""
    if not numbers.curves:
        return
    rows = [
        [name, *(_estimate(curve[name]) for curve in numbers.curves.values())] for name in ("gain", "offset", "gamma")
    ]
    _print_table("Its curves, ± standard error", ["", *numbers.curves], rows, console)


def _print_black(numbers: ModelNumbers, read_XYZ_cd_m2: Floats | None) -> None:
    """Print the light of code 0 by the model, and as it was read.

    A model's own term is not that light where its curves have offsets, so that errors are of the term alone.
    """
    shown = numbers.shown_black_XYZ_cd_m2
    plain = all(
        abs(light - term.value) < 1e-9 for light, term in zip(shown, numbers.black_XYZ_cd_m2.values(), strict=True)
    )
    terms = [_estimate(term) for term in numbers.black_XYZ_cd_m2.values()]
    by_model = terms if plain else [f"{light:.4f}" for light in shown]
    words = ", ".join(f"{axis} {value}" for axis, value in zip("XYZ", by_model, strict=True))
    if read_XYZ_cd_m2 is not None:
        read = ", ".join(f"{axis} {light:.4f}" for axis, light in zip("XYZ", read_XYZ_cd_m2, strict=True))
        words += f"; it was read as {read}"
    click.echo(f"Its black (code 0), in cd/m²: {words}")


def _print_thesis(fits: ThesisFits, console: Console) -> None:
    from devices.characterise import COEFFICIENTS

    for number, way, direct in (
        ("3.3", "XYZ from code", fits.XYZ_from_code),
        ("3.4", "code from XYZ", fits.code_from_XYZ),
    ):
        rows = [[row.kind, row.channel, *map(_number, (*row.r2_XYZ, row.average))] for row in direct]
        columns = ("", "", "R² X", "R² Y", "R² Z", "average")
        _print_table(f"The thesis's first method, {way} (as Table {number})", columns, rows, console, words=2)
    for number, way, kinds in (
        ("3.6", "light from code", fits.forward),
        ("3.5", "code from light", fits.inverse),
    ):
        rows = []
        for kind, channels in kinds.items():
            for place, name in enumerate(COEFFICIENTS):
                pairs = [(fit.coefficients[place], fit.standard_errors[place]) for fit in channels]
                if any(error for _, error in pairs):
                    rows.append([kind, name, *(f"{value:.4f} ± {error:.4f}" for value, error in pairs)])
            rows.append([kind, "R²", *(_number(fit.r2) for fit in channels)])
            rows.append([kind, "condition", *(_number(fit.condition, ".0f") for fit in channels)])
        title = f"Its second method, {way} (as Table {number}), ± standard error; codes in 0..1"
        _print_table(title, ("", "", "red", "green", "blue"), rows, console, words=2)


def _number(value: float | None, form: str = ".4f") -> str:
    import math

    return "–" if value is None or not math.isfinite(value) else f"{value:{form}}"


def _estimate(number: Estimate) -> str:
    if number.standard_error is None:
        return f"{number.value:.4f}"
    return f"{number.value:.4f} ± {number.standard_error:.4f}"
