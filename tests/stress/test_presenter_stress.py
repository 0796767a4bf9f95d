"""The presenter and the engine at their edges: every size, displays drawn at random, thousands of scenes and trials."""

from __future__ import annotations

import ctypes
import json
import threading
import time
import tracemalloc
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from devices.compensation import Correction, least_squares
from devices.display import EYES, DisplayModel, Eye, EyeModels, ToneCurve
from runner import Picture, Scene
from runner.blocks import BLOCKS
from runner.observers import plain_key
from runner.ports import Ask, Holding, KeyPress
from runner.presenter import MODES, PresentationError, Presenter, find_mode
from runner.presenter.depth import Bits
from runner.presenter.surfaces.egl import EglSurface
from runner.protocol import read_experiment
from runner.scene import Text
from runner.session import Event, Recorded, Session
from stimuli.pictures import StereoImage
from tests.displays import corrections, eye_models
from tests.runner.presenter.drawn_displays import (
    SIZE_PX,
    WITHIN_CODES,
    one_surface,
    worst_in_a_mode,
    worst_of_a_mixture,
    worst_of_an_eye,
)
from tests.stress.memory import forget_peak, peak_kb

pytestmark = pytest.mark.stress


# The presenter at its edges: tiny, odd, huge, far too bright, and thousands of scenes.

PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
Open = Callable[[tuple[int, int]], EglSurface]


def model(gamma: float = 2.4, black: float = 0.0, lift: float = 0.0) -> DisplayModel:
    curve = ToneCurve(1.0, 0.0, gamma, lift)
    return DisplayModel(black * np.array([0.95, 1.0, 1.2]), PRIMARIES, (curve, curve, curve))


MODEL = model()
BOTH = EyeModels(MODEL, MODEL)


@pytest.fixture
def open_egl() -> Iterator[Open]:
    """Open surfaces of any size, one after the other."""
    opened: list[EglSurface] = []

    def make(size_px: tuple[int, int]) -> EglSurface:
        while opened:
            opened.pop().close()
        try:
            opened.append(EglSurface(size_px))
        except PresentationError as error:
            pytest.skip(str(error))
        return opened[-1]

    yield make
    while opened:
        opened.pop().close()


def live_objects(surface: EglSurface) -> dict[str, int]:
    """Count the objects that exist; the names that are given out do not tell, because Mesa's only climb."""
    find = ctypes.CDLL("libEGL.so.1").eglGetProcAddress
    find.restype, find.argtypes = ctypes.c_void_p, [ctypes.c_char_p]
    count = {}
    texture = surface.context.texture((1, 1), 1)
    highest = 20 * texture.glo + 1000
    texture.release()
    for kind in ("Texture", "Framebuffer", "Program", "VertexArray"):
        exists = ctypes.CFUNCTYPE(ctypes.c_ubyte, ctypes.c_uint)(find(f"glIs{kind}".encode()))
        count[kind] = sum(exists(name) for name in range(1, highest))
    return count


def random_picture(height: int, width: int, seed: int = 0) -> StereoImage:
    codes = np.random.default_rng(seed).random((2, height, width, 3))
    return StereoImage(*MODEL.xyz(codes).astype(np.float32))


@pytest.mark.parametrize("surface_px", [(2, 1), (3, 3), (641, 479), (1920, 1080)])
@pytest.mark.parametrize("picture_px", [(1, 1), (1, 7), (3, 2), (333, 1), (1001, 1201), (4097, 3)])
def test_any_size_in_any_size_is_centred_by_floor_and_exact(
    open_egl: Open, surface_px: tuple[int, int], picture_px: tuple[int, int]
) -> None:
    width, height = picture_px
    picture = random_picture(height, width)
    surface = open_egl(surface_px)
    with Presenter(surface, find_mode("side-by-side"), BOTH, lambda _: picture) as presenter:
        presenter.show(Scene((Picture("a"),)))
        area_width, area_height = surface_px[0] // 2, surface_px[1]
        left, top = (area_width - width) // 2, (area_height - height) // 2
        for eye in ("left", "right"):
            expected = np.zeros((area_height, area_width, 3))
            codes = MODEL.code(picture.eye(eye)) * 255.0
            rows = slice(max(top, 0), min(top + height, area_height))
            columns = slice(max(left, 0), min(left + width, area_width))
            expected[rows, columns] = codes[
                rows.start - top : rows.stop - top, columns.start - left : columns.stop - left
            ]
            assert np.abs(presenter.eye_view(eye) - expected).max() <= 0.501


def test_light_far_beyond_the_panel_is_full_drive_or_black(open_egl: Open) -> None:
    values = np.array([1e30, -1e30, 3.4e38, -3.4e38, 1e-38, 1e-45, -1e-45, 0.0], np.float32)
    XYZ = np.repeat(values[:, np.newaxis], 3, axis=1)[np.newaxis]
    surface = open_egl((8, 1))
    with Presenter(surface, find_mode("flat"), BOTH, lambda _: StereoImage.flat(XYZ)) as presenter:
        presenter.show(Scene((Picture("a"),)))
        shown = presenter.capture()["screen"]
        assert np.abs(shown - MODEL.code(XYZ) * 255.0).max() <= 0.501
        assert (shown[0, 0] == 255).all()
        assert not shown[0, 1].any()


def test_thousands_of_scenes_leave_no_objects_and_no_memory_behind(open_egl: Open) -> None:
    surface = open_egl((320, 240))
    with Presenter(
        surface,
        find_mode("side-by-side"),
        BOTH,
        lambda name: random_picture(120, 100, int(name)),
        picture_budget_bytes=20 * 2 * 120 * 100 * 4,
    ) as presenter:

        def trials(numbers: range) -> None:
            for number in numbers:
                presenter.show(Scene((Picture(str(number % 50)), Text(f"trial {number}", width_px=100))))

        trials(range(500))
        objects_before = live_objects(surface)
        memory_before = forget_peak()
        trials(range(500, 3000))
        objects_after = live_objects(surface)
        memory_after = peak_kb()
        assert presenter.counters.frames_drawn == 3000
        assert presenter.counters.evictions == presenter.counters.decodes - 20
        # Each text is new, and kept: 2500 of them are far below the 64 MB for words.
        assert objects_after == {**objects_before, "Texture": objects_before["Texture"] + 2500}
        assert memory_after - memory_before < 100_000  # kB


def test_a_session_far_larger_than_the_budget_runs(open_egl: Open) -> None:
    surface = open_egl((1920, 1080))
    codes = np.random.default_rng(1).random((1333, 2000, 3))
    picture = StereoImage.flat(MODEL.xyz(codes).astype(np.float32))
    threads: set[str] = set()

    def load(name: str) -> StereoImage:
        threads.add(threading.current_thread().name)
        return picture

    with Presenter(surface, find_mode("flat"), BOTH, load, picture_budget_bytes=256 << 20) as presenter:
        presenter.show(Scene())
        traced: dict[int, int] = {}
        objects: dict[int, dict[str, int]] = {}
        tracemalloc.start()
        for number in range(200):
            presenter.prefetch(Scene((Picture(str(number)),)))
            presenter.show(Scene((Picture(str(number)),)))
            if number in (100, 199):  # the budget has been full for long
                traced[number], objects[number] = tracemalloc.get_traced_memory()[0], live_objects(surface)
        tracemalloc.stop()
        work = presenter.counters
        held = (256 << 20) // (4 * 2000 * 1333)
        assert (work.frames_drawn, work.decodes, work.uploads, work.evictions) == (201, 200, 200, 200 - held)
        top, left = (1333 - 1080) // 2 + 1, (2000 - 1920) // 2
        expected = MODEL.code(picture.left[top : top + 1080, left : left + 1920]) * 255.0
        assert np.abs(presenter.capture()["screen"] - expected).max() <= 0.501
    assert "decode_0" in threads
    # 99 pictures more would be 1.1 GB if any were kept. What the driver holds beyond these objects goes up and down by
    # hundreds of megabytes as it pleases, so that the process's size says nothing.
    assert objects[199] == objects[100]
    assert traced[199] - traced[100] < 1e6


@pytest.mark.parametrize(
    "mode", ["side-by-side", "top-bottom-half", "checkerboard", "anaglyph-red-cyan", "frame-sequential"]
)
def test_a_presenter_gives_back_every_object(open_egl: Open, mode: str) -> None:
    surface = open_egl((200, 100))
    picture = random_picture(50, 50)
    objects_before = live_objects(surface)
    for number in range(30):
        with Presenter(surface, find_mode(mode), BOTH, lambda _: picture) as presenter:
            presenter.show(Scene((Picture("a"), Text(f"{number}"))))
            presenter.prefetch(Scene((Picture("b"), Picture("c"))))
            during = live_objects(surface)
    assert during["Texture"] > objects_before["Texture"]
    objects_after = live_objects(surface)
    assert objects_after.pop("Program") <= objects_before.pop("Program") + 1  # the last one in use goes later
    assert objects_after == objects_before


@pytest.mark.parametrize("mode", ["side-by-side", "side-by-side-half", "anaglyph-red-cyan"])
def test_a_picture_that_is_given_up_between_two_bands_leaves_nothing(open_egl: Open, mode: str) -> None:
    surface = open_egl((200, 100))
    picture = random_picture(400, 500)
    objects_before = live_objects(surface)
    for steps in range(1, 30):
        with Presenter(surface, find_mode(mode), BOTH, lambda _: picture) as presenter:
            presenter.show(Scene())
            presenter.prefetch(Scene((Picture("a"),)))
            go_on = surface.on_wake
            assert go_on is not None
            while not presenter.counters.decodes:
                go_on()
            for _ in range(steps):
                go_on()
            made = presenter.counters.colour_passes
    assert made == (1 if mode.startswith("anaglyph") else 2)  # in the end the steps were enough
    objects_after = live_objects(surface)
    assert objects_after.pop("Program") <= objects_before.pop("Program") + 1  # the last one in use goes later
    assert objects_after == objects_before


# Every code within 0.501 of float64 on hundreds of displays drawn at random, other ones each time.

MANY = settings(max_examples=300, suppress_health_check=list(HealthCheck), deadline=None)
BITS = st.sampled_from([8, 10])
SEEDS = st.integers(0, 10**6)
EITHER = st.sampled_from(EYES)
UNLIFTED = corrections(SIZE_PX, lifts=False)
MODE_NAMES = tuple(name for name in MODES if not find_mode(name).needs_stereo)  # the others: tests/quad


drawn_surface = pytest.fixture(scope="module", name="drawn_surface")(one_surface)

# Which displays, what is corrected, for which eye, how many: Newton's method for both eyes takes seconds to compile.
CASES = {
    "adding up": (eye_models(plvc=False), st.none(), EITHER, 300),
    "acting on each other": (eye_models(plvc=True, residual=False), st.none(), st.just(EYES[0]), 25),
    "with some left over": (eye_models(plvc=True, residual=True), st.none(), st.just(EYES[0]), 25),
    "adding up, corrected": (eye_models(plvc=False), corrections(SIZE_PX), EITHER, 150),
    "acting on each other, corrected": (eye_models(plvc=True, residual=False), UNLIFTED, EITHER, 25),
    "with some left over, corrected": (eye_models(plvc=True, residual=True), UNLIFTED, EITHER, 25),
}


@pytest.mark.parametrize("case", CASES)
def test_an_eye_is_shown_what_was_asked(drawn_surface: EglSurface, case: str) -> None:
    models, correction, eye, examples = CASES[case]

    @settings(MANY, max_examples=examples)
    @given(models, correction, eye, BITS, SEEDS)
    def shown(models: EyeModels, correction: Correction | None, eye: Eye, bits: Bits, seed: int) -> None:
        assert max(worst_of_an_eye(drawn_surface, models, correction, eye, bits, seed).values()) <= WITHIN_CODES

    shown()


@settings(MANY, max_examples=100)
@given(models=eye_models(plvc=False), bits=BITS, seed=SEEDS)
def test_both_views_in_one_picture(drawn_surface: EglSurface, models: EyeModels, bits: Bits, seed: int) -> None:
    mixture = least_squares(EyeModels(models.left, models.left), (0.2, 0.01, 0.0), (0.0, 0.4, 0.3))
    assert max(worst_of_a_mixture(drawn_surface, models, mixture, bits, seed).values()) <= WITHIN_CODES


@settings(MANY, max_examples=150)
@given(models=eye_models(plvc=False), name=st.sampled_from(MODE_NAMES), seed=SEEDS)
def test_every_mode(drawn_surface: EglSurface, name: str, models: EyeModels, seed: int) -> None:
    both = EyeModels(models.left, models.left) if name == "flat" else models
    assert max(worst_in_a_mode(drawn_surface, find_mode(name), both, seed).values()) <= WITHIN_CODES


# What the engine costs for each kind of block, without drawing and without the disk; and that it keeps nothing.

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
ENGINE_MANY: Mapping[str, Sequence[str]] = {
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
ENGINE_CASES = [(kind, entry) for kind, entries in ENGINE_MANY.items() for entry in entries]


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
    assert set(ENGINE_MANY) == set(BLOCKS.own()) - {"instructions", "break"}


@pytest.mark.parametrize(
    ("kind", "entry"), ENGINE_CASES, ids=[f"{kind}-{number}" for number, (kind, _) in enumerate(ENGINE_CASES)]
)
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
