"""What a check is asked to look at, and what it reports: facts, in words too, warnings and errors."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from documents import Finding
from documents.options import MONITOR, Typed
from documents.text import JsonResult, counted

if TYPE_CHECKING:
    from documents.pages import Block, Table

# What a file says, in the order in which it is printed; every value is plain JSON.
Facts = dict[str, Any]
# Beyond this share of pixels the thesis calls an image excessively oversaturated (its footnote 6).
CLIP_LIMIT_PERCENT = 0.3
# Of which is stated what differences a design finds, where nobody says how many are planned.
TRIED_OBSERVERS = 5, 10, 15, 30


@dataclass(frozen=True, slots=True)
class CheckOptions:
    """What else to look at: the results folder, the screen, and the pictures, which may have to be built first.

    Attributes
    ----------
    screen
        Make it an error if this screen cannot show the experiment, or do not look at the screen. Default: give a
        warning.
    results
        Folder that the sessions will be written to.
    pictures
        Build the stimuli; without, clipping is not reported.
    clip_limit_percent
        Percentage of an eye's clipped pixels above which a stimulus gets a warning; 0.3 is the thesis's.
    accept_gamma_table
        Make it a warning, not an error, if the graphics card's gamma table is not the measured one.
    accept_changes
        Make it a warning, not an error, if experiment, stimuli, display or rig changed since the sessions before.
    mode
        Stereo mode to use instead of the rig's, as `cyclopean run --mode`.
    allow_uncharacterised
        Use another mode's characterisation if this mode has none.
    budget
        Report what each step from a picture's file to the eye costs in ΔE00, of a rig or an experiment.
    observers
        Number of observers planned: what differences an experiment finds with them; repeat for several. Default: 5,
        10, 15 and 30.
    monitors
        Monitor for the window, as `cyclopean doctor` lists them; twice for dual-window, the left eye's first. Default:
        the rig's, else the first of the panel's resolution.
    progress
        Called with what is being done, how much of it is done, and of how much.
    """

    screen: bool | None = None
    results: Path = Path("results")
    pictures: bool = True
    clip_limit_percent: Annotated[float, Typed("--clip-limit", "PERCENT", 0, 100)] = CLIP_LIMIT_PERCENT
    accept_gamma_table: bool = False
    accept_changes: bool = False
    mode: str | None = None
    allow_uncharacterised: bool = False
    budget: bool = False
    observers: Annotated[tuple[int, ...], Typed(least=2, most=1000)] = ()
    monitors: Annotated[tuple[str, ...], MONITOR] = ()
    progress: Callable[[str, int, int], None] = lambda what, done, of: None


@dataclass(frozen=True, slots=True)
class CheckReport(JsonResult):
    """A file's ``facts``; ``warnings`` are to be thought about, ``errors`` keep a session from running.

    `check_file` fills it as it reads.
    """

    file: Path
    facts: Facts = field(default_factory=dict)
    warnings: list[Finding] = field(default_factory=list)
    errors: list[Finding] = field(default_factory=list)
    json_keys: ClassVar = {"facts": "*", "errors": "findings"}

    def told(self) -> Iterator[Block | tuple[str | tuple[str, str], ...]]:
        """Yield the verdict, what people read of the facts, and the warnings."""
        from documents.pages import Facts

        facts = self.facts
        verdict = counted(len(self.errors), "error", "errors") if self.errors else "valid"
        doubts = f", {counted(len(self.warnings), 'warning', 'warnings')}" if self.warnings else ""
        yield ((f"{self.file}: {verdict}{doubts}", "bold"),)
        shown = [name for name in facts if name not in _APART]
        rows = [(_NAMES.get(name, name).replace("_", " "), _words(name, facts[name])) for name in shown]
        if "trials" in facts:
            minutes = counted(facts["minutes"], "minute", "minutes")
            rows.append(("session", f"{counted(facts['trials'], 'trial', 'trials')}, about {minutes}"))
        rows += _smallest(facts.get("smallest_difference") or ())
        rows += _screen(facts["screen"]) if "screen" in facts else ()
        if rows:
            yield Facts(tuple(rows))
        if "blocks" in facts:
            yield _blocks(facts["blocks"])
        if "clipped_percent" in facts:
            yield _clipping(facts)
        if "ghost_percent" in facts:
            yield _ghosts(facts["ghost_percent"], facts["ghost_cost_max_delta_e_00"])
        if "error_budget" in facts:
            yield _budget(facts["error_budget"])
        for finding in self.warnings:
            yield ("warning:", "yellow"), f" {finding}"

    def apart(self, as_json: bool) -> Iterator[tuple[str | tuple[str, str], ...]]:
        """Yield the errors, which JSON has."""
        for finding in () if as_json else self.errors:
            yield ("error:", "red"), f" {finding}"


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


def _words(name: str, value: object) -> str:
    if name.endswith("_deg") and isinstance(value, list):
        return " x ".join(f"{number:g}°" for number in value)
    if name.endswith("_px") and isinstance(value, list):
        return " x ".join(map(str, value))
    if isinstance(value, dict):
        return ", ".join(f"{key}: {_words('', item)}" for key, item in value.items())
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _smallest(found: Sequence[Mapping[str, Any]]) -> Iterator[tuple[str, str]]:
    """Yield the smallest difference that is found with each number of observers, and what was assumed for that."""
    name = "smallest difference"
    for one in found:
        camp = f"; all {one['observers']} of one camp in 1 study of {one['one_camp_in']}" if one["one_camp_in"] else ""
        yield name, f"{one['observers']} observers: {one['size']}{camp}"
        name = ""
    if found:
        where = f" in the group {found[0]['group']}" if found[0]["group"] else ""
        often = f"found in {100 * found[0]['target']:g} % of studies"
        yield "", f"between two stimuli{where}, {often}. {found[0]['assumed']}"


def _table(headings: Sequence[str], rows: Sequence[Sequence[str]], words: Sequence[int] = (0,)) -> Table:
    from documents.pages import Table

    return Table.of_texts("", headings, rows, words)


def _blocks(blocks: Sequence[Mapping[str, Any]]) -> Table:
    from runner.blocks import BLOCKS

    rows = []
    for number, block in enumerate(blocks, start=1):
        keys: dict[str, list[str]] = {}
        for key, meaning in block["keys"].items():
            keys.setdefault(meaning, []).append(key)
        pressed = "; ".join(f"{' or '.join(one)} = {meaning.replace('_', ' ')}" for meaning, one in keys.items())
        more = {name: one for name, one in block.items() if name not in ("kind", "trials", "minutes", "keys")}
        listed = [f"{name.replace('_', ' ')}: {_words('', one)}" for name, one in more.items()]
        details = BLOCKS[block["kind"]].in_words(more) or listed
        trials = str(block["trials"]) if block["trials"] else "-"
        rows.append((f"{number}  {block['kind']}", trials, f"{block['minutes']:.1f}", pressed, "; ".join(details)))
    return _table(("block", "trials", "minutes", "keys", "which has"), rows, (0, 3, 4))


def _clipping(facts: Mapping[str, Any]) -> Table:
    costs, filters = facts["clipping_cost_mean_delta_e_00"], facts.get("filters_cost_mean_delta_e_00")
    heads = ("outside the gamut", "% left", "right", "ΔE00 left", "right")
    rows = []
    for name, share in facts["clipped_percent"].items():
        cost = (*costs[name], *(filters or {}).get(name, ()))
        cells = (*(f"{one:.2f}" for one in share), *(f"{one:.3f}" for one in cost))
        rows.append((name, *cells, "!" if max(share) > facts["clip_limit_percent"] else ""))
    return _table((*heads, *(("ΔE00 of filters left", "right") if filters else ()), ""), rows)


def _ghosts(percents: Mapping[str, Sequence[float]], costs: Mapping[str, Sequence[float]]) -> Table:
    rows = [
        (name, *(f"{one:.2f}" for one in share), *(f"{one:.1f}" for one in costs[name]))
        for name, share in percents.items()
    ]
    return _table(("ghosts of crosstalk", "% left", "right", "largest ΔE00 left", "right"), rows)


def _budget(budget: Mapping[str, Any]) -> Table:
    rows = []
    for row in budget["steps"]:
        costs = [row[eye][name] if row[eye] else None for eye in ("left", "right") for name in ("mean", "p95", "max")]
        cells = ["-" if cost is None else f"{cost:.5f}" if cost < 0.1 else f"{cost:.3f}" for cost in costs]
        rows.append((row["step"].replace("_", " "), *cells, row["words"]))
    heads = (f"ΔE00 of {budget['colours']}", "mean left", "p95", "max", "mean right", "p95", "max", "")
    return _table(heads, rows, (0, 7))


def _screen(screen: Mapping[str, Any] | str) -> Iterator[tuple[str, str]]:
    if isinstance(screen, str):
        yield "screen", screen
        return
    possible = "can be shown here" if screen["mode_possible"] else "cannot be shown here"
    yield "screen", f"{', '.join(screen['monitors'])}; {screen['bits']} bits; the mode {possible}"
    yield "", f"{screen['renderer']}; {screen['compositor']}"
    for monitor, table in screen["gamma_tables"].items():
        yield "", f"gamma table of '{monitor}': {table}"
