"""What a study's files hold: from the decisions on kind, sizes, mode and light to the text of each file."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, get_args

from documents import counted
from documents.text import visible
from runner.presenter.modes.registry import MODES
from runner.studies.gather import Grouping, Member
from runner.studies.options import Kind, StudyOptions
from runner.studies.plan import GAP_MM, SizePlan
from runner.studies.screen import StudyScreen
from runner.views.layout import PHYSICAL

if TYPE_CHECKING:
    from jinja2 import Environment


KINDS: tuple[Kind, ...] = get_args(Kind)
EXPERIMENT, RIG, STIMULI, SIMULATED, README = (
    "experiment.yaml",
    "rig.yaml",
    "stimuli.yaml",
    "simulated.yaml",
    "README.md",
)
QUESTIONS: Mapping[Kind, str] = {
    "pairs": "Which image do you prefer?",
    "within-groups": "Which image do you prefer?",
    "best": "Which image is the best?",
    "rating": "How good is the image?",
}
BESIDE_A_REFERENCE: Mapping[Kind, str] = {
    "pairs": "Which image is closer to the reference?",
    "within-groups": "Which image is closer to the reference?",
    "best": "Which image is the closest to the reference?",
    "rating": "How similar is the image to the reference?",
}
# Half an hour of pairs, which is as long as a session should last (ITU-R BT.500).
MOST_PAIRS = 360
PAIRS_PER_STIMULUS = 10
PRACTICE_TRIALS = 3
BREAK_EVERY = 50
_ARRANGEMENTS = {
    "horizontal": "side by side; vertical: one above the other",
    "vertical": "one above the other; horizontal: side by side",
}
_GLASSES = {
    "anaglyph-red-cyan": "Wear the glasses: red before the left eye.",
    "anaglyph-green-magenta": "Wear the glasses: green before the left eye.",
    "anaglyph-amber-blue": "Wear the glasses: amber before the left eye.",
    "quad-buffered": "Keep the glasses on throughout.",
    "frame-sequential": "Keep the glasses on throughout.",
}


@dataclass(frozen=True, slots=True)
class StudyDesign:
    """All that was decided on a study; ``folder`` is what its folder is called, ``label`` the experiment's name."""

    folder: str
    label: str
    options: StudyOptions
    members: tuple[Member, ...]
    grouping: Grouping | None
    plan: SizePlan
    screen: StudyScreen
    mode: str
    white_cd_m2: float
    distance_mm: float

    @property
    def kind(self) -> Kind:
        """What observers do."""
        return self.options.kind

    @property
    def reference(self) -> str | None:
        """What the layout calls that with which pictures are compared."""
        return self.options.reference

    @property
    def question(self) -> str:
        """What observers are asked."""
        return self.options.question or (BESIDE_A_REFERENCE if self.reference else QUESTIONS)[self.kind]

    @property
    def names(self) -> tuple[str, ...]:
        """The names in the recipe of the pictures that are judged: all but a reference picture."""
        return tuple(member.name for member in self.members if member.name != self.reference)

    @property
    def is_of_pairs(self) -> bool:
        """Whether two pictures are shown at a time."""
        return self.kind in ("pairs", "within-groups")

    @property
    def pairs(self) -> int:
        """How many pairs of pictures there are to compare."""
        sizes = [len(names) for names in self.grouping.members.values()] if self.grouping else [len(self.names)]
        return sum(size * (size - 1) // 2 for size in sizes)

    @property
    def about(self) -> str:
        """Return what the study is, in a sentence."""
        count = counted(len(self.names), "picture", "pictures")
        if self.kind == "rating":
            return f"{count}, shown one at a time and rated."
        if self.kind == "best":
            series = counted(len(self.series), "series", "series")
            return f"{count} in {series}: observers look through each series and choose the best."
        within = " of the same group" if self.grouping else ""
        if self.pairs > MOST_PAIRS:
            return f"{count}; of the {self.pairs} pairs{within}, those come whose answers tell most."
        return f"{count}, every two{within} compared: {counted(self.pairs, 'pair', 'pairs')}."

    @property
    def series(self) -> Mapping[str, tuple[str, ...]]:
        """The series of which the best picture is chosen: those of folders of two pictures or more, else one of all."""
        if self.grouping and all(len(names) > 1 for names in self.grouping.members.values()):
            return self.grouping.members
        return {"all": self.names}

    @property
    def notes(self) -> tuple[str, ...]:
        """Return sentences on what was decided for the person, and how to change it."""
        notes = [self.plan.sentence]
        stereo = sum(member.picture.stereo for member in self.members)
        flat = len(self.members) - stereo
        which = " and ".join(f"{count} {what}" for count, what in ((stereo, "stereo"), (flat, "flat")) if count)
        notes.append(f"The stereo mode is {self.mode}, for {which} pictures.")
        if stereo:
            others = ", ".join(name for name in MODES if name not in (self.mode, "flat"))
            notes.append(f"Other modes, for --mode: {others}.")
        if self.grouping:
            notes.append(self.grouping.sentence)
        if self.screen.nominal:
            notes.append(
                f"The display is nominal, not measured: sRGB, white {self.white_cd_m2:g} cd/m². "
                f"To measure it: cyclopean display measure {self.place(RIG)}"
            )
        notes.append(self.screen.source)
        silent = sum(member.picture.colour_space is None for member in self.members)
        if silent:
            what = counted(silent, "picture does", "pictures do")
            notes.append(f"{what} not say which colour space they are in: sRGB is assumed (colour_space in {STIMULI}).")
        return tuple(notes)

    def place(self, file: str) -> str:
        """Return a file of the study as one types it in the folder that holds the study."""
        return typed([str(PurePath(self.folder, file))])


def commands(experiment: PurePath, label: str) -> tuple[tuple[str, ...], ...]:
    """Return the three commands that follow, as words, for an experiment file as it is called where they are typed."""
    return (
        ("cyclopean", "check", str(experiment)),
        ("cyclopean", "run", str(experiment), "--observer", "01"),
        ("cyclopean", "report", str(PurePath("results", label))),
    )


def next_steps(line: str, notes: Iterable[str], commands: Iterable[tuple[str, ...]]) -> Iterator[str]:
    """Yield a line on a study, the notes, and what to type next.

    The program is called as it was where the shell would not find it.
    """
    called = sys.argv[0]
    program = "cyclopean" if shutil.which("cyclopean") or Path(called).stem != "cyclopean" else called
    yield line
    yield from (f"  {note}" for note in notes)
    yield "Next:"
    yield from (f"  {typed([program, *words[1:]])}" for words in commands)


def typed(words: tuple[str, ...] | list[str]) -> str:
    """Return words as a person types them into this system's shell."""
    return subprocess.list2cmdline(words) if os.name == "nt" else shlex.join(words)


def copies_of_pictures(design: StudyDesign) -> dict[str, Path]:
    """Return each picture file to copy by its path in the study: under its picture's name, with its own suffix."""
    return {name: source for member in design.members for name, source in _copies(member).values()}


def _copies(member: Member) -> dict[str, tuple[str, Path]]:
    """Return the path in the study and the source of each key of a recipe's stimulus."""
    picture = member.picture
    files = {"left": picture.left, "right": picture.right, "file": picture.file}
    ends = {"left": "_L", "right": "_R", "file": ""}
    return {
        key: (f"pictures/{picture.name}{ends[key]}{path.suffix.lower()}", path)
        for key, path in files.items()
        if path is not None
    }


def written_files(design: StudyDesign) -> dict[str, str]:
    """Return the text of each file of the study by its name."""
    values = _values(design)
    names = (EXPERIMENT, RIG, STIMULI, SIMULATED, README)
    return {name: render(name, values) for name in names}


def _values(design: StudyDesign) -> dict[str, Any]:
    """Return what the templates ask for."""
    plan, screen = design.plan, design.screen
    spaces = Counter(member.picture.colour_space or "srgb" for member in design.members)
    common = spaces.most_common(1)[0][0]
    widths = {plan.width_mm(n) if not p.is_pixel_for_pixel else None for n, p in enumerate(plan.pictures)}
    shared_mm = next(iter(widths)) if len(widths) == 1 else None
    trials = len(design.names) if design.kind == "rating" else design.pairs
    monitors = design.options.monitors
    chosen = {"monitor": monitors[0] if len(monitors) == 1 else monitors} if monitors else {}
    three = commands(PurePath(design.folder, EXPERIMENT), design.label)
    return {
        "design": design,
        "plan": plan,
        "screen": screen,
        "gap_mm": GAP_MM,
        "arrangement_words": _ARRANGEMENTS[plan.arrangement],
        "panel": screen.panel.model_dump(mode="json"),
        "colour_space": common,
        "shared_width_mm": shared_mm,
        "stimuli": [_stimulus(design, number, common, shared_mm) for number in range(len(design.members))],
        "instructions": _instructions(design),
        "practice": PRACTICE_TRIALS if design.kind != "best" and trials > PRACTICE_TRIALS else 0,
        "block": _block(design),
        "break_every": BREAK_EVERY,
        "most_pairs": MOST_PAIRS,
        "pairs_per_stimulus": PAIRS_PER_STIMULUS,
        "scale": _scale(design),
        "scores": {
            name: round(2.0 ** (2 - 4 * n / max(1, len(design.members) - 1)), 3)
            for n, name in enumerate(member.name for member in design.members)
        },
        "rig": dict(screen.rig) | {"mode": design.mode, "distance_mm": design.distance_mm} | chosen
        if screen.rig
        else None,
        "monitor": chosen.get("monitor"),
        "trial": f"{typed(three[1])} --simulate {design.place(SIMULATED)} --results trial",
        "commands": [typed(words) for words in three],
    }


def _scores(names: tuple[str, ...]) -> dict[str, float]:
    """Return scores of simulated observers, from 4 for the first picture to 1/4 for the last."""
    steps = max(1, len(names) - 1)
    return {name: round(2.0 ** (2 - 4 * number / steps), 3) for number, name in enumerate(names)}


def _stimulus(design: StudyDesign, number: int, common_space: str, shared_mm: float | None) -> dict[str, Any]:
    """Return a line of the recipe: the entry, and the file names that it comes from where they are others."""
    member, size = design.members[number], design.plan.pictures[number]
    copies = _copies(member)
    entry: dict[str, Any] = {"name": member.name, **{key: name for key, (name, _) in copies.items()}}
    if member.picture.packing:
        entry["packing"] = member.picture.packing
    if (space := member.picture.colour_space or "srgb") != common_space:
        entry["colour_space"] = space
    if shared_mm is None and not size.is_pixel_for_pixel:
        entry["resample"] = {"width_mm": design.plan.width_mm(number)}
    if design.kind == "within-groups" and design.grouping and member.name in design.names:
        entry["factors"] = design.grouping.factors(member.name)
    renamed = any(Path(name).name != source.name for name, source in copies.values())
    originals = ", ".join(source.name for _, source in copies.values())
    return {"entry": entry, "comment": comment(f"from {originals}") if renamed else ""}


def _block(design: StudyDesign) -> dict[str, Any]:
    """Return the scored block as a practice repeats it."""
    if design.kind == "rating":
        return {"kind": "rating", "ratings": [_scale(design)]}
    if design.kind == "within-groups":
        return {"kind": "all_pairs", "within": "group"}
    return {"kind": "all_pairs"}


def _scale(design: StudyDesign) -> dict[str, Any]:
    """Return the scale that a picture is rated on."""
    name, low, high = ("similarity", "not similar", "the same") if design.reference else ("quality", "bad", "excellent")
    question = {"name": name, "question": design.question, "lowest": 1, "highest": 5}
    return {**question, "low_anchor": low, "high_anchor": high}


def _instructions(design: StudyDesign) -> list[str]:
    """Return the lines of the first page."""
    if design.kind == "rating":
        lines = ["Images appear one at a time.", design.question, "", "Press a number from 1 to 5, then Enter."]
    elif design.kind == "best":
        lines = ["Images appear one at a time. Look at all of them:", "left and right arrow, or the wheel.", ""]
        lines += [design.question, "Enter: choose the image that you see."]
    elif design.plan.arrangement == "horizontal":
        lines = ["Two images appear, side by side.", design.question, ""]
        lines += ["Left arrow: the left image.", "Right arrow: the right image."]
    else:
        lines = ["Two images appear, one above the other.", design.question, ""]
        lines += ["Up arrow: the upper image.", "Down arrow: the lower image."]
    glasses = _GLASSES.get(design.mode)
    place = "above" if design.is_of_pairs and design.plan.arrangement == "horizontal" else "at the left"
    if design.reference == PHYSICAL:
        lines += ["", "The reference is the real thing beside the screen."]
    elif design.reference:
        lines += ["", f"The reference is the image {place}."]
    return [line.replace("#|", "# |") for line in ([*lines, "", glasses] if glasses else lines)]


# Text that YAML takes as it stands, in flow lists too; all else goes in quotes.
_PLAIN = re.compile(r"[A-Za-z](?:[A-Za-z0-9_./ -]*[A-Za-z0-9_./-])?")
_COMMENTS = 30  # the column where comments begin, where the line is shorter
_NOT_TEXT = re.compile(r"(?i)null|true|false|yes|no|on|off|y|n")


def flow(value: object) -> str:
    """Return a value as YAML on one line.

    Parameters
    ----------
    value
        Text, a number, true or false, or lists and mappings of them.

    Returns
    -------
    str
        What `documents.yaml` reads as the same value.

    Examples
    --------
    >>> flow({"name": "1.1", "left": "pictures/a_L.jpg", "size": [2.50, True]})
    '{name: "1.1", left: pictures/a_L.jpg, size: [2.5, true]}'
    """
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{flow(key)}: {flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(flow, value)) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return f"{value:.12g}"
    text = str(value)
    plain = _PLAIN.fullmatch(text) and not _NOT_TEXT.fullmatch(text)
    return text if plain else json.dumps(text, ensure_ascii=False).replace("#|", "#\\u007c")


def comment(text: str) -> str:
    """Return text that may come from file names as it can stand behind a #: on one line, without hidden characters."""
    return " ".join(visible(text).split())


def render(template: str, values: Mapping[str, Any]) -> str:
    """Return the file that ``template`` makes with ``values``; comments after ``#|`` begin in one column."""
    text = _environment().get_template(template).render(**values)
    return re.sub(r"^(.*?\S) +#\| ", lambda found: f"{found[1]:<{_COMMENTS}}  # ", text, flags=re.MULTILINE)


@cache
def _environment() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("runner.studies"),
        autoescape=False,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"yaml": flow, "comment": comment}
    return environment
