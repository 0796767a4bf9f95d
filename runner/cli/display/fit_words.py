"""What `cyclopean display fit` prints of one eye's fits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from rich.console import Console


def tell(told: dict[str, Any], *, brief: bool) -> None:
    """Print the thesis's tables unless ``brief``, then every candidate, the chosen one's numbers, where it errs."""
    from rich.console import Console

    console = Console(highlight=False)
    if told["thesis"] and not brief:
        _thesis(told["thesis"], console)
    _candidates(told, console)
    click.echo(f"Chosen: {told['chosen']}, because {told['reason']}.")
    _numbers(told["numbers"], console)
    for found in told["candidates"]:
        if found["unusable"]:
            click.echo(f"{found['model']}: {found['unusable']}.")
        for name in found["at_bound"]:
            click.echo(f"{found['model']}: {name} ended at the edge of what is allowed.")
    click.echo("Where it errs:")
    for sentence in told["where_it_errs"]:
        click.echo(f"  {sentence}")
    tell_notes(told["said"])


def tell_notes(sentences: Iterable[str]) -> None:
    """Print each sentence as a note, closed by one full stop or its question mark."""
    for sentence in sentences:
        click.echo(f"Note: {sentence}" if sentence.endswith((".", "?")) else f"Note: {sentence}.")


def _print(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]], console: Console, words: int = 1) -> None:
    """Print a table, the first columns of which hold ``words``, each told where it changes only."""
    from rich.table import Table

    table = Table(box=None)
    for number, name in enumerate(columns):
        table.add_column(name, justify="left" if number < words else "right", no_wrap=True)
    before = ""
    for row in rows:
        table.add_row("" if words > 1 and row[0] == before else row[0], *row[1:])
        before = row[0]
    click.echo(title)
    console.print(table)


def _candidates(told: dict[str, Any], console: Console) -> None:
    rows = []
    for found in told["candidates"]:
        held = found["held_out_delta_e_2000"]
        rows.append(
            [
                ("→ " if found["model"] == told["chosen"] else "  ") + found["model"],
                str(found["free_numbers"]),
                *(f"{held[key]:.2f}" for key in ("mean", "p95", "max", "dark_mean")),
                f"{found['fitted_delta_e_2000']['mean']:.2f}",
                _number(found["r2"]["average"]),
                _number(found["condition"], ".0f"),
                _number(found["inversion_error_codes"], ".1g"),
                _number(found["table_error_codes"], ".2g"),
            ]
        )
    columns = ("model", "free", "mean", "p95", "max", "dark", "fit", "R²", "cond.", "inverse", "table")
    title = "Held-out ΔE00 (dark: its darkest third); the inverse's and the presenter's table's errors in 8-bit codes"
    _print(title, columns, rows, console)


def _numbers(numbers: dict[str, Any], console: Console) -> None:
    """Print the chosen model's curves and black with their standard errors, where the fit gives them."""
    if not numbers["curves"]:
        return
    rows = []
    for name in ("gain", "offset", "gamma"):
        cells = [curve[name] for curve in numbers["curves"].values()]
        rows.append([name, *(_with_error(cell["value"], cell["standard_error"]) for cell in cells)])
    _print("Its curves, ± standard error", ["", *numbers["curves"]], rows, console)
    black = numbers["black_XYZ_cd_m2"].items()
    told = ", ".join(f"{axis} {_with_error(cell['value'], cell['standard_error'])}" for axis, cell in black)
    click.echo(f"Its black, in cd/m²: {told}")


def _thesis(tables: dict[str, Any], console: Console) -> None:
    for number, way, key in (
        ("3.3", "XYZ from code", "method_1_XYZ_from_code_r2"),
        ("3.4", "code from XYZ", "method_1_code_from_XYZ_r2"),
    ):
        rows = [
            [row["model"], row["channel"], *(_number(row[name]) for name in ("X", "Y", "Z", "average"))]
            for row in tables[key]
        ]
        columns = ("", "", "R² X", "R² Y", "R² Z", "average")
        _print(f"The thesis's first method, {way} (as Table {number})", columns, rows, console, words=2)
    for number, way, key in (
        ("3.6", "light from code", "method_2_light_from_code"),
        ("3.5", "code from light", "method_2_code_from_light"),
    ):
        rows = []
        for kind, channels in tables[key].items():
            fits = list(channels.values())
            for name in ("gain", "offset", "gamma", "lift"):
                if any(fit["standard_errors"][name] for fit in fits):
                    cells = [_with_error(fit[name], fit["standard_errors"][name]) for fit in fits]
                    rows.append([kind, name, *cells])
            rows.append([kind, "R²", *(_number(fit["r2"]) for fit in fits)])
            rows.append([kind, "condition", *(_number(fit["condition"], ".0f") for fit in fits)])
        title = f"Its second method, {way} (as Table {number}), ± standard error; codes in 0..1"
        _print(title, ("", "", "red", "green", "blue"), rows, console, words=2)


def _number(value: float | None, form: str = ".4f") -> str:
    return "–" if value is None else f"{value:{form}}"


def _with_error(value: float, error: float | None) -> str:
    return f"{value:.4f}" if error is None else f"{value:.4f} ± {error:.4f}"
