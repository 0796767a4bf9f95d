"""`display patches` and `measure` in a real window, with real keys."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from tests.runner.measuring.displays import DISPLAY

pytestmark = [pytest.mark.window, pytest.mark.nightly]


@dataclass
class Window:
    """A command of `display` in a window on the display ``screen``, what it told, and its keys."""

    process: subprocess.Popen[str]
    environment: dict[str, str]
    told: list[str] = field(default_factory=list)

    def until(self, shown: str) -> None:
        """Wait for a line that begins so."""
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.told.append(line)
            if line.startswith(shown):
                return
        pytest.fail(f"'{shown}' was not told: {self.told}")

    def press(self, key: str) -> None:
        """Press a key."""
        subprocess.run(["xdotool", "key", key], env=self.environment, check=True)

    def end(self) -> str:
        """Wait for the command to end, and return what else it told."""
        return self.process.communicate(timeout=20)[1]


@pytest.fixture
def window(xvfb: str, tmp_path: Path) -> Iterator[Callable[..., Window]]:
    if shutil.which("xdotool") is None:
        pytest.skip("xdotool is not installed")
    (tmp_path / "display.yaml").write_text(DISPLAY.replace("[64, 48]", "[640, 480]"))
    environment = {**os.environ, "DISPLAY": xvfb}
    environment.pop("WAYLAND_DISPLAY", None)
    opened: list[Window] = []

    def open_window(command: str, *more: str) -> Window:
        code = "from runner.cli.main import main; main()"
        arguments = [sys.executable, "-c", code, "display", command, str(tmp_path / "display.yaml"), "--mode",
                     "row-interleaved", "--set", "grey", "--windowed", *more]  # fmt: skip
        process = subprocess.Popen(
            arguments, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
        )
        opened.append(Window(process, environment))
        return opened[-1]

    yield open_window
    for one in opened:
        one.process.kill()
        one.process.communicate()


def test_keys_go_on_back_and_stop(window: Callable[..., Window], tmp_path: Path) -> None:
    shown = window("patches", "-o", str(tmp_path / "shown.csv"))
    shown.until("1/39  black: 0 0 0")
    time.sleep(0.5)
    for key, told in (("Right", "2/39"), ("Right", "3/39"), ("Left", "2/39"), ("Return", "3/39")):
        shown.press(key)
        shown.until(told)
    shown.press("Escape")
    assert "stopped after 3 of 39 patches" in shown.end()
    assert shown.process.returncode == 1
    assert len((tmp_path / "shown.csv").read_text().splitlines()) == 4 + 3  # with the line of the gamma table
