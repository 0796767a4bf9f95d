"""A screen without a monitor, and where the real measurements lie."""

from __future__ import annotations

import atexit
import gc
import importlib
import io
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import settings

from analysis.records import SessionLog, read_session, session_files
from documents.extensions import ENVIRONMENT
from documents.yaml import expected
from tests.forked import Forked, Server

PATIENCE_S = 120.0  # a busy machine takes ten times as long as a quiet one
LOOKED_S = 0.3  # what is pressed sooner after a scene's onset, or after the same key, answers nothing

# No example has a deadline: how long one takes says how busy the machine is. `make test` tries the same examples every
# time, so that a failure belongs to the change before it; `make stress` looks for new ones, and for more.
settings.register_profile("patient", deadline=None, derandomize=True, max_examples=40)
settings.register_profile("searching", deadline=None)


def pytest_configure(config: pytest.Config) -> None:
    """Hear Ctrl-C in a shell's background too, and take the examples that are the same every time, unless asked.

    What `make test` draws Mesa's software renderer compiles without optimising, in half the time; `make nightly` draws
    what is optimised.
    """
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # which each program that a test starts would inherit
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if not config.getoption("--hypothesis-profile"):
        settings.load_profile("patient")
    if "not nightly" in config.option.markexpr:
        os.environ.setdefault("GALLIVM_PERF", "nopt")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Look for garbage while tests run, never among the million things that collecting makes for good."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        atexit.register(gc.unfreeze)  # else OpenImageIO counts what is left at the end as leaked
        gc.set_threshold(10_000, 20, 50)  # as the program does
        gc.enable()


def _cyclopean(*words: object, expect: int | None = 0, text: str = "") -> subprocess.CompletedProcess[str]:
    from runner.cli.main import main

    typed, out, err = (io.TextIOWrapper(io.BytesIO(part), "utf-8") for part in (text.encode(), b"", b""))
    command = ["cyclopean", *map(str, words)]
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        patch.setattr(sys, "argv", command)
        patch.setattr(sys, "stdin", typed)
        with pytest.raises(SystemExit) as left:
            main()
    for stream in (out, err):
        stream.seek(0)
    told = subprocess.CompletedProcess(command, int(left.value.code or 0), out.read(), err.read())
    assert expect in (None, told.returncode), told.stderr
    return told


@pytest.fixture(scope="session")
def unchained() -> Callable[[Path], None]:
    """Take the checksums off a log's lines, as older versions wrote them."""

    added = ("line", "chain", "lines", "chained")

    def unchain(file: Path) -> None:
        lines = [json.loads(line) for line in file.read_bytes().splitlines()]
        kept = [{key: value for key, value in line.items() if key not in added} for line in lines]
        text = "".join(json.dumps(line, ensure_ascii=False, separators=(",", ":")) + "\n" for line in kept)
        file.write_bytes(text.encode("utf-8", "backslashreplace"))

    return unchain


@pytest.fixture(scope="session")
def cyclopean() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Run the program's ``main`` on words, without a terminal, in this process: a new one takes seconds to start.

    Exit status ``expect`` is asserted unless it is None; ``text`` is what its standard input holds. An exception that
    `main` does not catch is raised.
    """
    return _cyclopean


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., None]]:
    """Put packages of one module beside Python's own, each with what it offers by name."""
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    before = set(sys.modules)

    def look_again() -> None:
        importlib.invalidate_caches()
        for found in ("_file", "_held", "_scanned"):
            vars(ENVIRONMENT).pop(found, None)
        expected._schema.cache_clear()

    def put(package: str, text: str, version: str = "1.0", group: str = "cyclopean.things", **offers: str) -> None:
        facts = tmp_path / "site" / f"{package}-0.dist-info"
        facts.mkdir(parents=True, exist_ok=True)
        (tmp_path / "site" / f"{package}.py").write_text(text)
        (facts / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: {version}\n")
        lines = [f"{name} = {package}:{attribute}" for name, attribute in offers.items()]
        (facts / "entry_points.txt").write_text("\n".join([f"[{group}]", *lines]))
        look_again()

    yield put
    look_again()
    for name in set(sys.modules) - before:
        if str(tmp_path) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real measurements that ``CYCLOPEAN_SHARED_DATA`` names: unasked, nothing outside is read."""
    named = os.environ.get("CYCLOPEAN_SHARED_DATA")
    if not named:
        pytest.skip("CYCLOPEAN_SHARED_DATA names no folder of real measurements")
    return Path(named)


@pytest.fixture(scope="session")
def xvfb() -> Iterator[str]:
    """The name of an X display of 1920 × 1080 on a virtual screen, such as ``:99``."""
    yield from _x_server("1920x1080x24")


@pytest.fixture(scope="session")
def gamma_server() -> Iterator[str]:
    """An X display of 640 × 480 whose gamma table tests may change."""
    yield from _x_server("640x480x24")


@pytest.fixture
def load_table(gamma_server: str, monkeypatch: pytest.MonkeyPatch) -> Callable[[float], None]:
    """Use that display, and return what loads a power of the code as its gamma table; 1.1 is loaded."""
    from devices.display import GammaTable
    from runner.presenter.surfaces.gamma_tables import set_tables

    monkeypatch.setenv("DISPLAY", gamma_server)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("XDG_SESSION_TYPE", "x11")

    def load(exponent: float) -> None:
        entries = GammaTable.from_shares(np.linspace(0.0, 1.0, 256) ** exponent).entries
        assert entries is not None
        set_tables({"screen": entries})

    load(1.1)
    return load


@pytest.fixture(autouse=True, scope="session")
def own_state(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep what outlives a process away from the user's own folder; wait for no disk, but in processes of their own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CYCLOPEAN_STATE", str(tmp_path_factory.mktemp("state")))
        patch.setattr(os, "fsync", lambda _: None)
        yield


def _x_server(screen: str) -> Iterator[str]:
    if shutil.which("Xvfb") is None:
        pytest.skip("Xvfb is not installed (package xvfb)")
    read, write = os.pipe()
    options = ["-screen", "0", screen, "-nolisten", "tcp", "-noreset"]
    server = subprocess.Popen(["Xvfb", "-displayfd", str(write), *options], pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    try:
        with os.fdopen(read) as told:
            number = told.readline().strip()
        if not number:
            pytest.skip("Xvfb did not start")
        yield f":{number}"
    finally:
        server.terminate()
        server.wait()


DISPLAY = """\
schema_version: 1
panel: {{resolution_px: [{width}, {height}], pixel_pitch_mm: 0.25}}
modes:
  side-by-side:
    black_XYZ_cd_m2: [0.02, 0.02, 0.03]
    primaries_XYZ_cd_m2: {{red: [10.83, 5.62, 0.54], green: [9.67, 18.65, 1.63], blue: [5.68, 2.20, 29.18]}}
    curve: {{kind: gog, red: {{gamma: 2.1}}, green: {{gamma: 2.2}}, blue: {{gamma: 2.3}}}}
    source: made up for tests
  quad-buffered: {{same_as: side-by-side}}
"""
EXPERIMENT = """\
schema_version: 1
name: small
rig: rig.yaml
stimuli: recipe.yaml
question: Which is closer?
layout: {arrangement: vertical, size_mm: [20, 10], gap_mm: 5}
blocks:
  - {kind: instructions, text: Look at the two pictures.}
  - {kind: all_pairs, break_every: 4}
"""


@dataclass(frozen=True, slots=True)
class Study:
    """A small experiment of four pictures on disk, and simulated observers for it."""

    folder: Path
    cyclopean: Callable[..., subprocess.CompletedProcess[str]] = _cyclopean

    @property
    def experiment(self) -> Path:
        """The experiment file."""
        return self.folder / "small.yaml"

    @property
    def observers(self) -> Path:
        """Simulated observers."""
        return self.folder / "observers.yaml"

    @property
    def results(self) -> Path:
        """Where sessions are to go."""
        return self.folder / "results"

    def run(self, *more: object, observer: str = "01", expect: int | None = 0, **other: Path) -> Any:
        """Run a simulated observer's session by the command, with ``more`` words and ``other`` files or results."""
        files = {"results": self.results, "simulate": self.observers} | other
        named = [word for name, path in files.items() for word in (f"--{name}", path)]
        return self.cyclopean("run", self.experiment, "--observer", observer, *named, *more, expect=expect)

    def log_file(self) -> Path:
        """Return the only log of the results."""
        (file,) = session_files(self.results)
        return file

    def edit(self, file: str, old: str, new: str) -> None:
        """Replace ``old``, which must be there, in one of the study's files."""
        path = self.folder / file
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))


def write_study(folder: Path) -> Study:
    """Write four pictures (two stereo, two flat), a display of 640 × 480, a rig, an experiment."""
    import numpy as np

    from stimuli.pictures import StereoImage, write_exr

    rng = np.random.default_rng(4)
    names = ("one", "two", "three", "four")
    for index, name in enumerate(names):
        left, right = (rng.uniform(1, 20, (40, 80, 3)).astype(np.float32) for _ in range(2))
        write_exr(folder / f"{name}.exr", StereoImage(left, right) if index < 2 else StereoImage.flat(left))
    pictures = "".join(f"  - {{name: {name}, file: {name}.exr}}\n" for name in names)
    (folder / "recipe.yaml").write_text(f"schema_version: 1\nkind: pictures\nstimuli:\n{pictures}")
    (folder / "display.yaml").write_text(DISPLAY.format(width=640, height=480))
    (folder / "rig.yaml").write_text("schema_version: 1\ndisplay: display.yaml\nmode: side-by-side\ndistance_mm: 700\n")
    (folder / "small.yaml").write_text(EXPERIMENT)
    scores = "".join(f"  {name}: {{score: {index + 1}}}\n" for index, name in enumerate(names))
    (folder / "observers.yaml").write_text(f"schema_version: 1\nkind: bradley_terry\nstimuli:\n{scores}")
    return Study(folder)


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Study:
    """Four pictures, a display, a rig and an experiment, as `write_study` writes them, and a cache of their own."""
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    return write_study(tmp_path)


@pytest.fixture
def install_fonts(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., None]]:
    """Let only the fonts that it is called with be installed here; none before."""
    from documents import fonts

    def install(*files: Path) -> None:
        monkeypatch.setattr("matplotlib.font_manager.findSystemFonts", lambda: list(map(str, files)))
        for known in (fonts.installed_fonts, fonts.font_of):
            known.cache_clear()

    install()
    yield install
    for known in (fonts.installed_fonts, fonts.font_of):
        known.cache_clear()


class Person:
    """Someone at the keyboard and the mouse of the display ``screen``."""

    def __init__(self, screen: str, study: Study, server: Server) -> None:
        self.screen = screen
        self.study = study
        self.server = server
        self.process: Forked | subprocess.Popen[str] | None = None
        self.before = ""  # Python to run in the session's process before it
        self.timed_s: float | None = 0.05  # how long swaps are timed; all cores are busy then where no screen waits
        self._pointer_px = (0, 0)

    def sit_down(self, *more: str) -> None:
        """Start the session and wait for its window to have drawn."""
        self._start(*more)
        self.until(lambda: np.any(self.look()), "the window to draw something")

    def refused_to_sit_down(self, why: str, *more: str) -> None:
        """Start the session, and see it refused, with nothing on the screen."""
        self._start(*more)
        told = self.leave()
        assert why in told
        assert self.process is not None
        assert self.process.returncode == 2
        assert not np.any(self.look())

    @property
    def words(self) -> list[str]:
        """What is typed after ``cyclopean run``."""
        return [str(self.study.experiment), "--observer", "07", "--results", str(self.study.results)]

    def _start(self, *more: str) -> None:
        timed = "" if self.timed_s is None else f"from runner.session import station; station.TIMED_S = {self.timed_s}"
        code = f"{timed}\n{self.before}\nfrom runner.cli.main import main; main()"
        environment = {**os.environ, "DISPLAY": self.screen}
        environment.pop("WAYLAND_DISPLAY", None)
        self.process = self.server.start(code, ["run", *self.words, *more], environment)

    def press(self, *keys: str) -> None:
        """Press keys one after the other."""
        for key in keys:
            self._xdotool("key", key)
            time.sleep(0.05)

    def turn(self, key: str, to: str = "the next screen") -> None:
        """Leave a page, a break or the menu by ``key``; wait until the next screen was looked at long enough."""
        seen = self.look()
        self.press(key)
        self.until(partial(self._sees_other_than, seen), to)

    def type(self, words: str) -> None:
        """Type words, letter by letter."""
        self._xdotool("type", "--delay", "60", words)

    def wheel(self, steps: int) -> None:
        """Turn the wheel, upwards if ``steps`` is positive."""
        for _ in range(abs(steps)):
            self._xdotool("click", "4" if steps > 0 else "5")

    def move(self, x: int, y: int) -> None:
        """Move the pointer, which starts in the middle, to a place in pixels from the middle of a view."""
        right, down = x - self._pointer_px[0], y - self._pointer_px[1]
        self._xdotool("mousemove_relative", "--", str(right), str(down))
        self._pointer_px = (x, y)

    def click(self, x: int, y: int) -> None:
        """Click at a place in pixels from the middle of a view, once the pointer follows the mouse."""
        time.sleep(0.4)
        self.until(self._pointer_follows, "the pointer to follow the mouse")
        self.move(x, y)
        time.sleep(0.2)
        self._xdotool("click", "1")

    def _pointer_follows(self) -> bool:
        """Move the mouse to and fro by a pixel; return whether that is seen."""
        for step in ("1", "-1"):
            seen = self.look()
            self._xdotool("mousemove_relative", "--", step, "0")
            end = time.monotonic() + 0.5
            while time.monotonic() < end:
                if self._sees_other_than(seen):
                    return True
                time.sleep(0.03)
        return False

    def answer(self, *keys: str) -> None:
        """Answer pairs, each pressed once the one before is on disk and the next is on the screen."""
        for key in keys:
            before, seen = self.answers(), self.look()
            self.press(key)
            self.until(partial(self._answered_more_than, before), f"the answer '{key}' to be on disk", looked_s=0.0)
            self.until(partial(self._sees_other_than, seen), "the next screen")

    def window(self, *words: str) -> None:
        """Do something to the session's window with xdotool: windowmove 10 10, windowminimize, ..."""
        window = self._xdotool("search", "--name", "^cyclopean$").split()[-1]
        self._xdotool(words[0], window, *words[1:])

    def _answered_more_than(self, answers: int) -> bool:
        return self.answers() > answers

    def _sees_other_than(self, seen: np.ndarray) -> bool:
        return bool(np.any(self.look() != seen))

    def close_the_window(self) -> None:
        """Ask the window to close, as a window manager does."""
        self.window("windowclose")

    def look(self) -> np.ndarray:
        """Return what is on the screen, (height, width, 3)."""
        from PIL import ImageGrab

        shown = ImageGrab.grab(xdisplay=self.screen)
        assert shown.mode == "RGB"
        return np.asarray(shown)

    def log(self) -> SessionLog:
        """Return the session's log."""
        (file,) = session_files(self.study.results)
        return read_session(file)

    def answers(self) -> int:
        """Return how many pairs are on disk."""
        files = list(session_files(self.study.results)) if self.study.results.exists() else []
        return sum(trial.kind == "all_pairs" for file in files for trial in read_session(file).trials)

    def until(self, come_true: Callable[[], object], what: str, looked_s: float = LOOKED_S) -> None:
        """Wait for something to come true, much longer than it takes, for the machine may be busy; and look at it.

        Each pause is longer than the one before: a look at the screen takes as much of the processor as the pause.
        """
        end = time.monotonic() + PATIENCE_S
        pause_s = 0.05
        while time.monotonic() < end:
            if come_true():
                time.sleep(looked_s)
                return
            if self.process is not None and self.process.poll() is not None:
                break
            time.sleep(pause_s)
            pause_s = min(1.3 * pause_s, 0.25)
        if come_true():
            return
        told = self.leave()
        pytest.fail(f"waited in vain for {what}; the program said: {told}")

    def leave(self, press: str = "space") -> str:
        """Leave the page after the last answer by ``press``, wait for the program to end and return what it said."""
        assert self.process is not None
        end = time.monotonic() + PATIENCE_S
        while self.process.poll() is None and time.monotonic() < end:
            files = sorted(session_files(self.study.results)) if self.study.results.exists() else []
            if files and read_session(files[-1]).complete:
                self.press(press)
            time.sleep(0.1)
        try:
            told, _ = self.process.communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            told, _ = self.process.communicate()
        return told

    def _xdotool(self, *words: str) -> str:
        environment = {**os.environ, "DISPLAY": self.screen}
        return subprocess.run(["xdotool", *words], env=environment, check=True, capture_output=True, text=True).stdout


@pytest.fixture(scope="session")
def forked() -> Iterator[Server]:
    """The process that persons' sessions are forked from."""
    server = Server()
    yield server
    server.close()


@pytest.fixture
def person(xvfb: str, study: Study, forked: Server) -> Iterator[Person]:
    """Someone who can sit down to the study."""
    if shutil.which("xdotool") is None:
        pytest.skip("xdotool is not installed (package xdotool)")
    someone = Person(xvfb, study, forked)
    yield someone
    if someone.process is not None and someone.process.poll() is None:
        someone.process.kill()
        someone.process.communicate()


class _Undrawn:
    """Axes that take whatever is drawn on them, and keep nothing."""

    def __getattr__(self, name: str) -> _Undrawn:
        if name.startswith("__"):
            raise AttributeError(name)
        return self

    def __call__(self, *_: object, **__: object) -> _Undrawn:
        return self

    def __getitem__(self, _: object) -> _Undrawn:
        return self

    def __iter__(self) -> Iterator[_Undrawn]:
        return iter((self,))

    def get_text(self) -> str:
        return ""

    def get_size_in_points(self) -> float:
        return 0.0

    def get_yaxis_text1_transform(self, _: float) -> tuple[object, str, str]:
        return self, "center", "right"

    get_yaxis_text2_transform = get_yaxis_text1_transform


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make figures of a page without drawing anything, which takes longer than all else: for tests of other parts."""

    def subplots(_: object, rows: int = 1, columns: int = 1, *, squeeze: bool = True, **__: object) -> Any:
        axes = np.full((rows, columns), None, dtype=object)
        for place in np.ndindex(rows, columns):
            axes[place] = _Undrawn()
        return axes if not squeeze else axes[0, 0] if axes.size == 1 else axes.squeeze()

    def svg(_: object, out: Any, **__: object) -> None:
        out.write('<svg viewBox="0 0 1 1"></svg>')

    def pdf(_: object, out: Any, **__: object) -> None:
        out.write(b"%PDF-")

    monkeypatch.setattr("matplotlib.figure.Figure.subplots", subplots)
    for beside in ("legend", "colorbar"):
        monkeypatch.setattr(f"matplotlib.figure.Figure.{beside}", lambda *_, **__: _Undrawn())
    monkeypatch.setattr("matplotlib.textpath.text_to_path.get_text_width_height_descent", lambda *_: (0.0, 0.0, 0.0))
    monkeypatch.setattr("matplotlib.backends.backend_svg.FigureCanvasSVG.print_svg", svg)
    monkeypatch.setattr("matplotlib.backends.backend_pdf.FigureCanvasPdf.print_pdf", pdf)


@pytest.fixture
def blas_threads_kept() -> Iterator[None]:
    """After the test, each OpenBLAS has as many threads as before."""
    from documents.blas_threads import blas_threads, set_blas_threads

    before = max(blas_threads(), default=1)
    yield
    set_blas_threads(before)
