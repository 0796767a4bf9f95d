"""`cyclopean check`: every fault in a file and in what it names, at once, before anyone sits down."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import click


@click.command(short_help="Check an experiment file and everything it names.")
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print what each file amounts to, and the faults, as JSON.")
def command(files: tuple[Path, ...], as_json: bool) -> None:
    """Check an experiment file and everything it names.

    FILES may be experiments, displays, rigs, stimulus recipes and simulated observers. All faults are told at once,
    each with file, line, column and what would be right; the exit status is 2 if there are any.
    """
    from dataclasses import asdict

    from documents import InputError
    from runner.check import check_file

    told = []
    faults = 0
    for file in files:
        try:
            facts = check_file(file)
            told.append({"file": str(file), **facts, "findings": []})
            if not as_json:
                click.echo(f"{file}: right")
                for name, value in facts.items():
                    _print_fact(name, value)
        except InputError as error:
            faults += len(error.findings)
            told.append({"file": str(file), "findings": [asdict(finding) for finding in error.findings]})
            if not as_json:
                for finding in error.findings:
                    click.echo(f"error: {finding}", err=True)
    if as_json:
        click.echo(json.dumps(told, ensure_ascii=False))
    if faults:
        sys.exit(2)


def _print_fact(name: str, value: object) -> None:
    if name == "remarks":
        for remark in value if isinstance(value, list) else ():
            click.echo(f"  note: {remark}")
        return
    if isinstance(value, dict) and any(isinstance(item, list) for item in value.values()):
        click.echo(f"  {name.replace('_', ' ')} (left, right):")
        for key, item in value.items():
            click.echo(f"    {key}: {', '.join(f'{number:g}' for number in item)}")
        return
    if isinstance(value, dict):
        value = ", ".join(f"{key}: {item}" for key, item in value.items())
    elif isinstance(value, list):
        value = ", ".join(str(item) for item in value)
    click.echo(f"  {name.replace('_', ' ')}: {value}")
