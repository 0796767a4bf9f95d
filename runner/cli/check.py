"""`cyclopean check`: every fault in a file and in what it names, at once, before a session."""

from __future__ import annotations

import json
import shutil
import sys
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from documents.text import say
from runner.check.report import CheckOptions
from runner.cli.options import takes

if TYPE_CHECKING:
    from runner.check.report import CheckReport

_LABEL = 22
# What is called otherwise than in JSON, where the unit is part of the name.
_NAMES = {
    "picture_deg": "a picture covers",
    "picture_px": "which is, in pixels",
    "white_luminance_cd_m2": "white, in cd/m²",
    "unfinished_sessions_of": "unfinished sessions",
    "sessions_running_of": "sessions running now",
    "refresh_hz": "refresh rate, in Hz",
    "safe_luminance_cd_m2": "safe zone, in cd/m²",
}
# What is printed in tables of their own, or is only for programs.
_APART = (
    "blocks",
    "keys",
    "clipped_percent",
    "clipping_cost_mean_delta_e_00",
    "filters_cost_mean_delta_e_00",
    "filters_cost_max_delta_e_00",
    "clip_limit_percent",
    "ghost_percent",
    "ghost_cost_max_delta_e_00",
    "pictures_rendered",
    "clipping_costs_computed",
    "clipping_costs_cached",
    "error_budget",
    "smallest_difference",
    "trials",
    "minutes",
    "screen",
)


@click.command(short_help="Check an experiment file and everything it names.")
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--screen/--no-screen",
    default=None,
    help="Make it an error if this screen cannot show the experiment, or do not look at the screen. "
    "Default: give a warning.",
)
@takes(CheckOptions, leave_out={"screen", "progress"})
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    files: tuple[Path, ...],
    screen: bool | None,
    as_json: bool,
    options: CheckOptions,
) -> None:
    """Check an experiment file and everything it names.

    FILES may be experiments, displays, rigs, stimulus recipes, cameras, regions and simulated observers. All errors
    are reported at once, each with file, line, column and a remedy. With an error no session can run, and the exit
    status is 2. A warning is something to think about.
    """
    from runner.check.files import check_file
    from runner.check.report import TRIED_OBSERVERS, ScreenCheck
    from runner.cli.output import progress_bar

    looking: dict[bool | None, ScreenCheck] = {None: "if present", True: "required", False: "skip"}
    options = replace(options, screen=looking[screen], observers=options.observers or TRIED_OBSERVERS)
    all_checked = []
    for file in files:
        with progress_bar(quiet=as_json) as step:
            found = check_file(file, replace(options, progress=step))
        all_checked.append(found)
        if not as_json:
            _print(found)
    if as_json:
        click.echo(json.dumps([report.to_json() for report in all_checked]))
    if any(report.errors for report in all_checked):
        sys.exit(2)


def _print(report: CheckReport) -> None:
    """Print facts on standard output; warnings and errors after them, errors on the error stream."""
    verdict = _counted(len(report.errors), "error") if report.errors else "right"
    doubts = f", {_counted(len(report.warnings), 'warning')}" if report.warnings else ""
    say((f"{report.file}: {verdict}{doubts}", "bold"))
    for line in _lines(report.facts):
        click.echo(f"  {line}".rstrip())
    for finding in report.warnings:
        say(("warning:", "yellow"), f" {finding}")
    for finding in report.errors:
        say(("error:", "red"), f" {finding}", errors=True)


def _counted(count: float, what: str) -> str:
    return f"{count:g} {what}" + ("" if count == 1 else "s")


def _lines(facts: Mapping[str, Any]) -> Iterator[str]:
    for name, value in facts.items():
        if name not in _APART:
            yield from _labelled(name, _words(name, value))
    if "trials" in facts:
        yield from _labelled(
            "session", f"{_counted(facts['trials'], 'trial')}, about {_counted(facts['minutes'], 'minute')}"
        )
        yield ""
        yield from _blocks(facts["blocks"])
    if facts.get("smallest_difference"):
        yield ""
        yield from _smallest(facts["smallest_difference"])
    if "clipped_percent" in facts:
        yield ""
        yield from _clipping(facts)
    if "ghost_percent" in facts:
        yield ""
        yield from _ghosts(facts["ghost_percent"], facts["ghost_cost_max_delta_e_00"])
    if "error_budget" in facts:
        yield ""
        yield from _budget(facts["error_budget"])
    if "screen" in facts:
        yield ""
        yield from _screen(facts["screen"])


def _smallest(found: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield the smallest difference that is found with each number of observers, and what was assumed for that."""
    name = "smallest difference"
    for one in found:
        camp = f"; all {one['observers']} of one camp in 1 study of {one['one_camp_in']}" if one["one_camp_in"] else ""
        yield from _labelled(name, f"{one['observers']} observers: {one['size']}{camp}")
        name = ""
    where = f" in the group {found[0]['group']}" if found[0]["group"] else ""
    often = f"between two stimuli{where}, found in {100 * found[0]['target']:g} % of studies. {found[0]['assumed']}"
    yield from _labelled("", often)


def _labelled(name: str, words: str) -> Iterator[str]:
    width = max(40, shutil.get_terminal_size((110, 24)).columns - _LABEL - 4)
    for number, line in enumerate(textwrap.wrap(words, width, break_long_words=False, break_on_hyphens=False) or [""]):
        yield f"{'' if number else _NAMES.get(name, name).replace('_', ' '):<{_LABEL}}{line}"


def _words(name: str, value: object) -> str:
    if name.endswith("_deg") and isinstance(value, list):
        return " x ".join(f"{number:g}°" for number in value)
    if name.endswith("_px") and isinstance(value, list):
        return " x ".join(map(str, value))
    if isinstance(value, dict):
        return ", ".join(f"{key}: {_words('', item)}" for key, item in value.items())
    if isinstance(value, list):
        return ", ".join(map(str, value))
    return str(value)


def _blocks(blocks: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    yield f"{'block':<{_LABEL}}{'trials':>6}  {'minutes':>7}  keys"
    for number, block in enumerate(blocks, start=1):
        keys: dict[str, list[str]] = {}
        for key, meaning in block["keys"].items():
            keys.setdefault(meaning, []).append(key)
        what = "; ".join(f"{' or '.join(pressed)} = {meaning.replace('_', ' ')}" for meaning, pressed in keys.items())
        trials = str(block["trials"]) if block["trials"] else "-"
        lead = f"{number}  {block['kind']}".ljust(_LABEL)
        lead += f"{trials:>6}  {block['minutes']:>7.1f}  "
        width = max(40, shutil.get_terminal_size((110, 24)).columns - len(lead) - 2)
        for line in textwrap.wrap(what, width, break_long_words=False, break_on_hyphens=False) or [""]:
            yield lead + line
            lead = " " * len(lead)
        more = {k: v for k, v in block.items() if k not in ("kind", "trials", "minutes", "keys")}
        if block["kind"] == "screening":
            details = [_screening_words(test, facts) for test, facts in more.items()]
        else:
            details = ["; ".join(f"{key.replace('_', ' ')}: {_words('', value)}" for key, value in more.items())]
        for detail in filter(None, details):
            indent = " " * (_LABEL + 17)
            width = max(40, shutil.get_terminal_size((110, 24)).columns - len(indent) - 2)
            for line in textwrap.wrap(detail, width, break_long_words=False, break_on_hyphens=False):
                yield indent + line


_UNITS = {"arcsec": " arcsec", "logmar": " logMAR", "delta_uv": " of u'v'"}


def _screening_words(test: str, facts: Mapping[str, Any]) -> str:
    """Return a vision test in a sentence: what passes it, the levels from coarse to fine, and those left out."""
    unit = facts["unit"]
    levels, left_out = facts.get(f"levels_{unit}", []), facts.get(f"not_shown_{unit}", [])
    words = f"{test.replace('_', ' ')}: passed at {facts['pass_mark']:g}{_UNITS.get(unit, f' {unit}')} or finer"
    if levels:
        words += f", shown from {max(levels):g} to {min(levels):g}"
    if left_out:
        words += f"; this screen cannot show {', '.join(f'{level:g}' for level in left_out)}"
    return f"{words}."


def _clipping(facts: Mapping[str, Any]) -> Iterator[str]:
    shares, costs = facts["clipped_percent"], facts["clipping_cost_mean_delta_e_00"]
    filters = facts.get("filters_cost_mean_delta_e_00")
    name_width = max([_LABEL - 2, *(len(name) for name in shares)]) + 2
    heads = f"{'outside the gamut':<{name_width}}{'% left':>8}{'right':>8}   {'ΔE00 left':>9}{'right':>8}"
    yield heads + (f"   {'by filters left':>15}{'right':>8}" if filters else "")
    for name, (left, right) in shares.items():
        cost_left, cost_right = costs[name]
        line = f"{name:<{name_width}}{left:>8.2f}{right:>8.2f}   {cost_left:>9.3f}{cost_right:>8.3f}"
        line += f"   {filters[name][0]:>15.3f}{filters[name][1]:>8.3f}" if filters else ""
        yield line + ("  !" if max(left, right) > facts["clip_limit_percent"] else "")


def _ghosts(percents: Mapping[str, Sequence[float]], costs: Mapping[str, Sequence[float]]) -> Iterator[str]:
    name_width = max([_LABEL - 2, *(len(name) for name in percents)]) + 2
    yield f"{'ghosts of crosstalk':<{name_width}}{'% left':>8}{'right':>8}   {'largest ΔE00':>12}{'right':>8}"
    for name, (left, right) in percents.items():
        yield f"{name:<{name_width}}{left:>8.2f}{right:>8.2f}   {costs[name][0]:>12.1f}{costs[name][1]:>8.1f}"


def _budget(budget: Mapping[str, Any]) -> Iterator[str]:
    yield from _labelled("error budget", f"ΔE00 of {budget['colours']}")
    yield f"{'step':<{_LABEL}}{'mean left':>9}{'p95':>8}{'max':>8}{'mean right':>12}{'p95':>8}{'max':>8}"
    for row in budget["steps"]:
        costs = [row[eye][name] if row[eye] else None for eye in ("left", "right") for name in ("mean", "p95", "max")]
        cells = ["-" if cost is None else f"{cost:.5f}" if cost < 0.1 else f"{cost:.3f}" for cost in costs]
        widths = (9, 8, 8, 12, 8, 8)
        numbers = "".join(cell.rjust(width) for cell, width in zip(cells, widths, strict=True))
        yield f"{row['step'].replace('_', ' '):<{_LABEL}}{numbers}  {row['words']}"


def _screen(screen: Mapping[str, Any] | str) -> Iterator[str]:
    if isinstance(screen, str):
        yield from _labelled("screen", screen)
        return
    possible = "can be shown here" if screen["mode_possible"] else "cannot be shown here"
    yield from _labelled("screen", f"{', '.join(screen['monitors'])}; {screen['bits']} bits; the mode {possible}")
    yield from _labelled("", f"{screen['renderer']}; {screen['compositor']}")
    for monitor, table in screen["gamma_tables"].items():
        yield from _labelled("", f"gamma table of '{monitor}': {table}")
