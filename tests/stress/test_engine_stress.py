"""What the engine costs for each kind of block, without drawing and without the disk; and that it keeps nothing."""

from __future__ import annotations

import json
import time
import tracemalloc
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

from runner import Scene
from runner.blocks import BLOCKS
from runner.observers import plain_key
from runner.ports import Ask, Holding, KeyPress
from runner.protocol import read_experiment
from runner.session import Event, Recorded, Session

pytestmark = pytest.mark.stress
ROOT = Path(__file__).parents[2]
# One millisecond where a line takes 7 µs: a limit in seconds would say how fast the processor is, and how busy.
LIMIT_LINES = 140
LINE = json.dumps({"trial": 1, "pair": ["a", "b"], "keys": [["up", 1.25]] * 8, "time": "2026-01-01T00:00:00.000+00:00"})
SCALE = "{name: quality, question: How good}"
SERIES = ", ".join(f"s{number}: [a, b, c, d, e, f]" for number in range(500))
QUESTIONS = ", ".join(
    f"{{name: c{n}, question: Which, kind: choice, options: [left, right]}}, {{name: t{n}, question: What, kind: text}}"
    for n in range(100)
)
# As many trials of each kind as its file can ask for, up to some thousands.
MANY: Mapping[str, Sequence[str]] = {
    "all_pairs": (
        "repeats: 400",
        "repeats: 400, catch: {every: 5, pairs: [[a, b]], identical: 3}, ties: both, fixation_s: 0.2, exposure_s: 1",
        f"repeats: 200, ratings: [{SCALE}]",
        "repeats: 300, presentation: sequence, exposure_s: 0.5",
    ),
    "active_pairs": ("trials: 5000",),
    "best_of_series": (f"series: {{{SERIES}}}",),
    "rating": (f"repeats: 800, ratings: [{SCALE}]",),
    "preference": ("repeats: 2500, pairs: [[a, b], [c, d]]",),
    "questionnaire": (f"questions: [{QUESTIONS}]",),
    "threshold": (
        "factor: codec, task: two_places, reference: f, trials: 5000",
        "factor: codec, task: yes_no, trials: 2500, method: {kind: staircase, up: 1, start: [above, below]}",
    ),
    "practice": ("trials: 5000, block: {kind: all_pairs, repeats: 400}",),
    "screening": (
        "tests: [{test: stereo_acuity, repeats: 20, required: 3}, {test: colour_vision, repeats: 20, required: 3}]",
    ),
}
CASES = [(kind, entry) for kind, entries in MANY.items() for entry in entries]


class _Nothing:
    """A screen, a log and an observer that keep nothing; half a second passes with each answer."""

    session: Session

    def __init__(self) -> None:
        self.trials = 0
        self.sizes: dict[int, int] = {}

    def show(self, scene: Scene) -> float:
        return 0.0

    def prefetch(self, scene: Scene) -> None:
        pass

    def hold(self, scene: Scene, seconds: float) -> Holding:
        return Holding(0.0, 1, seconds)

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        return KeyPress(plain_key(ask), onset_s + 0.5)

    def hear(self, event: Event) -> None:
        if isinstance(event, Recorded):
            self.trials += 1
            if tracemalloc.is_tracing() and self.trials in (10_000, 29_000):
                self.session.answers.clear()
                self.sizes[self.trials] = tracemalloc.get_traced_memory()[0]


def _run(folder: Path, kind: str, entry: str) -> tuple[_Nothing, float]:
    """Return what counted the trials, and the processor's seconds for each, drawing up the order included."""
    pictures = "".join(
        f"  - {{name: {name}, file: {name}.exr, factors: {{codec: {level}}}}}\n"
        for level, name in enumerate("abcdef", 1)
    )
    (folder / "recipe.yaml").write_text(f"schema_version: 1\nkind: pictures\nstimuli:\n{pictures}")
    (folder / "many.yaml").write_text(
        f"schema_version: 1\nname: many\nrig: {ROOT}/configs/rigs/asus_vg248qe_3dvision.yaml\nstimuli: recipe.yaml\n"
        "question: Which is closer?\nlayout: {arrangement: vertical, size_mm: [60, 40]}\n"
        f"blocks:\n  - {{kind: {kind}, {entry}}}\n"
    )
    blocks = read_experiment(folder / "many.yaml").blocks("01")
    nothing = _Nothing()
    began_s = time.process_time()
    nothing.session = Session(blocks, nothing, nothing, nothing)
    nothing.session.run()
    return nothing, (time.process_time() - began_s) / nothing.trials


def _line_s() -> float:
    """Return the processor's seconds for a line of a log, read and written again."""
    began_s = time.process_time()
    for _ in range(2000):
        json.dumps(json.loads(LINE))
    return (time.process_time() - began_s) / 2000


def test_no_scored_kind_is_forgotten() -> None:
    assert set(MANY) == set(BLOCKS.own()) - {"instructions", "break"}


@pytest.mark.parametrize(("kind", "entry"), CASES, ids=[f"{kind}-{number}" for number, (kind, _) in enumerate(CASES)])
def test_a_trial_costs_under_a_millisecond(kind: str, entry: str, tmp_path: Path) -> None:
    """In one of three runs a trial takes the processor less than reading and writing ``LIMIT_LINES`` lines of a log."""
    for _ in range(3):
        before_s = _line_s()
        nothing, each_s = _run(tmp_path, kind, entry)
        lines = 2 * each_s / (before_s + _line_s())
        print(f"{kind}: {nothing.trials} trials, {1000 * each_s:.3f} ms each, as {lines:.0f} lines")
        assert nothing.trials > 30
        if lines < LIMIT_LINES:
            return
    pytest.fail(f"a trial of {kind} takes as long as {lines:.0f} lines of a log, not less than {LIMIT_LINES}")


@pytest.mark.parametrize(
    ("kind", "entry"),
    [
        ("all_pairs", "repeats: 1667, catch: {every: 5, pairs: [[a, b]], identical: 3}"),
        ("preference", "repeats: 15000, pairs: [[a, b], [c, d]]"),
    ],
)
def test_thirty_thousand_trials_keep_nothing(kind: str, entry: str, tmp_path: Path) -> None:
    """What is drawn up at the start stays; after that, a trial leaves nothing behind."""
    tracemalloc.start()
    try:
        nothing, _ = _run(tmp_path, kind, entry)
    finally:
        tracemalloc.stop()
    assert nothing.trials > 29_500
    assert nothing.sizes[29_000] - nothing.sizes[10_000] < 25_000
