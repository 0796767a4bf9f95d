"""One small block of each kind, as people write them: what every test of all kinds goes through.

A kind that is new needs an entry here; `test_every_kind.py` fails until it has one.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import Any

from pydantic import TypeAdapter

from analysis.kinds import Trial
from analysis.records import FILE_NAME, Header, Mark, Note, PooledBatch, WindowEvent, new_header
from devices.display import Rig, read_rig
from runner import Scene
from runner.blocks import AnyBlock, Block, BlockContext, Draft, Stimuli
from runner.observers import key_for, plain_key, walk
from runner.ports import Ask, Choose, Compare, Holding, KeyPress
from runner.protocol import Experiment, read_experiment
from runner.session import Ended, Event, Recorded, Recorder, Replayed, Resumed, SessionStatus
from runner.views import FULL_HD_HALF, LayoutSpec, Style

ROOT = Path(__file__).parents[2]
_BOTH = "{name: gloss, question: How glossy, of: both, lowest: 1, highest: 9}"
_SCALE = "{name: quality, question: How good, lowest: 1, highest: 5}"

# Every kind, and its variants that take other ways through the code.
BLOCKS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "instructions": ("text: Look.",),
        "break": ("text: Rest.",),
        "all_pairs": (
            "stimuli: [a, b, c, d], break_every: 4",
            "stimuli: [a, b, c], repeats: 2, ties: both, fixation_s: 0.2, exposure_s: 0.5, blank_s: 0.1",
            f"stimuli: [a, b, c, d], catch: {{every: 3, pairs: [[a, b]], identical: 1}}, ratings: [{_SCALE}, {_BOTH}]",
            "stimuli: [a, b, c], presentation: sequence, exposure_s: 0.5",
            "within: scene, repeats: 2, break_every: 4",
            "within: scene, per_observer: 5, balance: pairs, repeats: 2",
            "per_observer: 8, break_every: 4, catch: {identical: 2}",
            "within: scene, across: codec, catch: {every: 4, pairs: [[a, d]], identical: 1}",
        ),
        "active_pairs": (
            "within: scene, trials: 11",
            "trials: 14",
            "trials: 8, batch: 1, gain: entropy, ties: both, break_every: 3",
            "trials: 18, pool: results, ties: both, break_every: 4",
            "within: scene, trials: 5, batch: 1, pool: results",
        ),
        "best_of_series": (
            "series: {one: [a, b, c], two: [d, e, f]}",
            f"series: {{one: [a, b], two: [c, d, e]}}, ratings: [{_SCALE}], see_all: false, wrap: true, break_every: 1",
        ),
        "rating": (
            f"ratings: [{_SCALE}], repeats: 2",
            f"stimuli: [a, b], ratings: [{_SCALE}], exposure_s: 0.5, fixation_s: 0.2, blank_s: 0.1, break_every: 1",
        ),
        "preference": (
            "pairs: [[a, b], [c, d]], exposure_s: 0.5",
            "pairs: [[a, b], [c, d]], presentation: simultaneous, repeats: 2, break_every: 2",
        ),
        "threshold": (
            "factor: codec, task: two_places, reference: f, trials: 9, break_every: 4",
            "factor: codec, task: two_intervals, exposure_s: 0.5, fixation_s: 0.2, blank_s: 0.1, reference: f, "
            "trials: 5, method: {kind: staircase, up: 1, start: [above, below]}, function: logistic",
            "factor: codec, task: yes_no, within: scene, trials: 5, break_every: 3",
            "factor: codec, task: yes_no, easier: lower, reference: f, catch_share: 0.3, exposure_s: 0.5, trials: 6",
        ),
        "questionnaire": (
            "questions: [{name: age, question: How old, kind: number, unit: years, lowest: 1, highest: 99}, "
            "{name: gender, question: Which gender, kind: choice, options: [woman, man]}, "
            "{name: other, question: Which hand, kind: choice, options: [left, right], required: false}, "
            "{name: words, question: What else, kind: text, required: false}]",
        ),
        "practice": (
            "trials: 3, feedback: choice, block: {kind: all_pairs, stimuli: [a, b, c, d]}",
            "trials: 6, until: {correct: 0.5, of: 2}, "
            "block: {kind: all_pairs, stimuli: [a, b, c, d], catch: {every: 2, pairs: [[a, b]]}}",
            f"trials: 2, block: {{kind: rating, ratings: [{_SCALE}]}}",
            "trials: 3, until: {correct: 0.5, of: 2}, "
            "block: {kind: screening, tests: [{test: near_acuity, pass_logmar: 0.3}]}",
        ),
        "screening": (
            "tests: [{test: stereo_acuity, pass_arcsec: 200, levels_arcsec: [400, 200], repeats: 2, required: 1}, "
            "{test: near_acuity, pass_logmar: 0.5, levels_logmar: [0.6, 0.5], repeats: 2, required: 2}]",
        ),
    }
)
STIMULI = tuple(
    {"name": name, "factors": {"scene": scene, "codec": codec}}
    for name, scene, codec in zip("abcdef", ("beach",) * 3 + ("church",) * 3, (1, 2, 3) * 2, strict=True)
)
HEADER = new_header("e", "01", "s", "2026-01-01T00:00:00.000+00:00", question="Which?", simulated=True, stimuli=STIMULI)
# The pages of words record no trial; the number of trials of these hangs on the answers.
OPEN_ENDED = ("practice", "screening")


def experiment(folder: Path, *blocks: str, more: str = "", rig: Path | None = None) -> Experiment:
    """Write an experiment of ``blocks`` to ``folder``, with ``more`` keys, and read it."""
    return read_experiment(write(folder, *blocks, more=more, rig=rig))


def write(
    folder: Path, *blocks: str, more: str = "", rig: Path | None = None, layout: str = "size_mm: [60, 40]"
) -> Path:
    """Write an experiment of ``blocks`` and return its file."""
    folder.mkdir(exist_ok=True, parents=True)
    pictures = "".join(
        f"  - {{name: {name}, file: {name}.exr, factors: {{scene: {scene}, codec: {codec}}}}}\n"
        for name, scene, codec in zip("abcdef", ("beach",) * 3 + ("church",) * 3, (1, 2, 3) * 2, strict=True)
    )
    (folder / "recipe.yaml").write_text(f"schema_version: 1\nkind: pictures\nstimuli:\n{pictures}")
    file = folder / "every_kind.yaml"
    file.write_text(
        "schema_version: 1\nname: every_kind\n"
        f"rig: {rig or ROOT / 'configs/rigs/asus_vg248qe_3dvision.yaml'}\n"
        "stimuli: recipe.yaml\nquestion: Which is closer?\n"
        f"layout: {{arrangement: vertical, {layout}, gap_mm: 10}}\nblocks:\n"
        + "".join(f"  - {{{block}}}\n" for block in blocks)
        + more
    )
    return file


def written(kind: str, variant: int) -> str:
    """Return the entry of a block."""
    return f"kind: {kind}, {BLOCKS[kind][variant]}"


@cache
def of_kind(kind: str, variant: int = 0) -> Experiment:
    """Return an experiment with a block of the kind between two pages of words.

    It is read once in a process, which takes longer than most sessions of it; its files are not there any more.
    """
    words = "kind: instructions, text: Look."
    with TemporaryDirectory() as folder:
        return experiment(Path(folder), words, written(kind, variant), words)


def blocks_of(kind: str, variant: int = 0, observer: str = "01") -> tuple[Block, ...]:
    """Return its blocks, new ones at each call."""
    return of_kind(kind, variant).blocks(observer)


@cache
def rig() -> Rig:
    """Return a rig that shows an eye 960 x 1080 pixels."""
    return read_rig(ROOT / "configs/rigs/asus_vg248qe_3dvision.yaml")


def setting(
    stimuli: Iterable[str] | Stimuli = (),
    observer: str = "01",
    *,
    arrangement: str = "vertical",
    size_mm: tuple[float, float] = (60, 40),
    style: Style = FULL_HD_HALF,
    **more: Any,
) -> BlockContext:
    """Return what ``observer`` meets a block on these stimuli in; ``more`` are other attributes of it."""
    known = stimuli if isinstance(stimuli, Stimuli) else Stimuli({name: {} for name in stimuli})
    reference = known.reference or more.pop("reference", "none")
    layout = LayoutSpec.model_validate(
        {"arrangement": arrangement, "size_mm": size_mm, "gap_mm": 10, "reference": reference}
    )
    common = {"experiment": "e", "seed": 0, "question": "Which?", "layout": layout, "rig": rig(), "style": style}
    return BlockContext(**{**common, "stimuli": known, "observer": observer, **more})


def entry(kind: str, **keys: Any) -> Any:
    """Return an entry of ``blocks:``, of its kind."""
    return TypeAdapter(AnyBlock).validate_python({"kind": kind, **keys})


def met(kind: str, place: BlockContext, **keys: Any) -> Block:
    """Return the block that an entry is in a setting."""
    block: Block = entry(kind, **keys).meet(place)
    return block


def pairs_of(block: Block) -> list[tuple[str, str]]:
    """Return the pairs that a block compares, in order: the stimuli in the first and the second place."""
    drafts = [step for step in walk(block) if isinstance(step, Draft)]
    return [(draft.data["first"], draft.data["second"]) for draft in drafts]


@dataclass
class Stage:
    """A screen on which nothing is drawn, a sheet that keeps what is recorded, and all that they got to see."""

    shown: list[Scene] = field(default_factory=list)
    prefetched: list[Scene] = field(default_factory=list)
    trials: list[Trial] = field(default_factory=list)
    pooled: list[PooledBatch] = field(default_factory=list)
    notes: list[Note] = field(default_factory=list)
    marks: list[Mark] = field(default_factory=list)
    shown_at_record: list[int] = field(default_factory=list)
    asks: list[Ask] = field(default_factory=list)
    ends: list[Mapping[str, Any]] = field(default_factory=list)

    def show(self, scene: Scene) -> float:
        self.shown.append(scene)
        return float(len(self.shown))

    def prefetch(self, scene: Scene) -> None:
        self.prefetched.append(scene)

    def hold(self, scene: Scene, seconds: float) -> Holding:
        return Holding(self.show(scene), round(seconds * 60), 1 / 60)

    def hear(self, event: Event) -> None:
        match event:
            case Recorded(Trial() as trial):
                self.trials.append(trial)
                self.shown_at_record.append(len(self.shown))
            case Recorded(Note() as note):
                self.notes.append(note)
            case Recorded(Mark() as mark):
                self.marks.append(mark)
            case Recorded(PooledBatch() as batch):
                self.pooled.append(batch)
            case Ended(facts):
                self.ends.append(facts)


@dataclass
class OnTrial:
    """Does something with each trial of a session, also one that was read from its log."""

    do: Callable[[Trial], object]

    def hear(self, event: Event) -> None:
        match event:
            case Recorded(Trial() as trial) | Replayed(trial):
                self.do(trial)


@dataclass
class OnStatus:
    """Does something with a session's status after each of its records."""

    do: Callable[[SessionStatus], object]
    status: SessionStatus = field(default_factory=SessionStatus)

    def hear(self, event: Event) -> None:
        self.status.hear(event)
        match event:
            case Recorded(Trial() | WindowEvent()):
                self.do(self.status)


@dataclass(slots=True)
class Fickle:
    """Compares and detects at random, with the plainest answer to all else; its time goes on as it answers."""

    seed: int
    rng: random.Random = field(init=False)

    def __post_init__(self) -> None:
        self.rng = random.Random(self.seed)

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        """Press something that means something."""
        key = plain_key(ask)
        if isinstance(ask.task, Compare):
            key = key_for(ask, self.rng.choice(sorted({*ask.keys.values()})))
        if isinstance(ask.task, Choose) and ask.task.name == "codec":
            key = key_for(ask, self.rng.choice(ask.task.options))
        return KeyPress(key, onset_s + self.rng.uniform(0.1, 3.0))


def opened(folder: Path, header: Header = HEADER) -> tuple[Recorder, Resumed]:
    """Return the log of a session that is begun in ``folder``, or resumed, and what it holds."""
    if not (folder / FILE_NAME).exists():
        return Recorder.create(folder, header), Resumed()
    recorder, log = Recorder.reopen(folder)
    return recorder, Resumed.of(log)


# Each kind with each way it is written.
OF_EXTENSIONS = ("active_pairs", "screening", "threshold")
VARIANTS = [(kind, variant) for kind, written in BLOCKS.items() for variant in range(len(written))]
