"""Gamma tables read from a real X server, the identity loaded for a session, and what was there before restored."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from devices.display import GammaTable
from documents import InputError
from documents.platform import boot_id
from runner.presenter import LoadedTable, PresentationError, monitors, open_surface
from runner.presenter.surfaces import gamma_tables, identity_tables
from runner.presenter.surfaces.gamma_tables import Entries, set_tables
from runner.presenter.surfaces.glfw_session import GlfwSession
from runner.presenter.surfaces.identity_tables import IdentityTables, restore_left, tables_folder
from runner.presenter.surfaces.windows import WindowSurface
from tests.choice import nightly
from tests.forked import Server

pytestmark = pytest.mark.window

Load = Callable[[float], None]
SIZE_PX = (320, 240)
OPEN = """
import signal, sys
from runner.presenter.surfaces.windows import WindowSurface
signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGUSR1})
with WindowSurface((320, 240), windowed=True, identity=True):
    open(sys.argv[1], "x").close()
    signal.sigwait({signal.SIGUSR1})
"""
# What `python -m` makes of the module that loads tables, with what it is given.
LOAD = """
import io, sys
sys.stdin = io.StringIO({given!r})
from {module} import main
main()
"""
PATIENCE_S = 60.0


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLOPEAN_STATE", str(tmp_path))


@pytest.fixture(autouse=True)
def set_by_fork(forked: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fork the processes that load tables for this one: new ones take long to start. Those of `Other` are new."""

    def run(command: list[str], **options: Any) -> subprocess.CompletedProcess[str]:
        code = LOAD.format(given=options["input"], module=command[-1])
        process = forked.start(code, [], options["env"])
        told, _ = process.communicate(options["timeout"])
        assert process.returncode is not None
        return subprocess.CompletedProcess(command, process.returncode, told, "")

    monkeypatch.setattr(gamma_tables, "subprocess", SimpleNamespace(run=run, TimeoutExpired=subprocess.TimeoutExpired))


class Other:
    """Another process with a window that has loaded the identity."""

    def __init__(self, server: Server, ready: Path) -> None:
        self.process = server.start(OPEN, [str(ready)], {**os.environ})
        end_s = time.monotonic() + PATIENCE_S
        while not ready.exists():
            assert self.process.poll() is None, self.process.communicate()[0]
            assert time.monotonic() < end_s
            time.sleep(0.02)

    def kill(self) -> None:
        """End it by force."""
        self.process.kill()
        self.process.communicate()

    def end(self) -> None:
        """Let it close its window."""
        self.process.send_signal(signal.SIGUSR1)
        told, _ = self.process.communicate(timeout=PATIENCE_S)
        assert self.process.returncode == 0, told


@pytest.fixture
def other(forked: Server, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[], Other]]:
    opened: list[Other] = []
    folder = tmp_path_factory.mktemp("others")

    def start() -> Other:
        opened.append(Other(forked, folder / str(len(opened))))
        return opened[-1]

    yield start
    for one in opened:
        one.kill()


def loaded() -> GammaTable:
    """The table that is loaded."""
    (monitor,) = monitors()
    return monitor.gamma_table


def is_power(table: GammaTable, exponent: float) -> bool:
    return table.same_as(GammaTable.from_shares(np.linspace(0, 1, 256) ** exponent)) is True


def kept() -> list[str]:
    """What of a table to restore is on disk."""
    return [file.name for file in tables_folder().iterdir() if file.name != ".lock"] if tables_folder().exists() else []


def test_a_window_reads_the_table_of_its_monitor(load_table: Load) -> None:
    with WindowSurface(SIZE_PX, windowed=True) as window:
        for exponent in (1.1, 0.8):
            load_table(exponent)
            both = window.gamma_tables()
            assert both["left"] is both["right"]
            assert both["left"].monitor == "screen"
            assert is_power(both["left"].table, exponent)
            assert not is_power(both["left"].table, exponent + 0.02)


def test_where_there_is_no_table_the_reason_is_said(load_table: Load) -> None:
    set_tables({"screen": np.zeros((256, 3), np.uint16)})
    with WindowSurface(SIZE_PX, windowed=True) as window:
        zeros = window.gamma_tables()["left"]
    assert (zeros.monitor, "all its entries are 0" in zeros.table.unknown) == ("screen", True)
    for backend, why in (("egl", "without a window"), ("null", "no screen")):
        try:
            surface = open_surface(backend, SIZE_PX)
        except InputError as error:
            pytest.skip(str(error))
        with surface:
            table = surface.gamma_tables()["left"]
        assert (table.monitor, table.table.known) == ("", False)
        assert why in table.table.unknown


def test_a_table_for_a_monitor_that_is_not_there_is_refused(load_table: Load) -> None:
    entries = GammaTable.identity().entries
    assert entries is not None
    with pytest.raises(PresentationError, match="no monitor 'DP-7'"):
        set_tables({"DP-7": entries})
    with pytest.raises(PresentationError, match="did not take the table"):
        set_tables({"screen": entries[::2]})


def test_the_identity_lasts_as_long_as_the_window(load_table: Load) -> None:
    with WindowSurface(SIZE_PX, windowed=True, identity=True) as window:
        assert window.gamma_tables()["left"].table.is_identity
        assert len(kept()) == 2  # the table, and that it is needed
    assert is_power(loaded(), 1.1)
    assert kept() == []


def test_the_next_start_after_a_kill_restores_the_table_and_says_so(
    load_table: Load, other: Callable[[], Other]
) -> None:
    other().kill()
    assert loaded().is_identity
    with WindowSurface(SIZE_PX, windowed=True) as window:
        assert is_power(window.gamma_tables()["left"].table, 1.1)
        (remark,) = window.facts.remarks
    assert "a session that was killed left the identity as gamma table of 'screen'" in remark
    assert kept() == []
    with WindowSurface(SIZE_PX, windowed=True) as window:
        assert window.facts.remarks == ()
    assert is_power(loaded(), 1.1)


@pytest.mark.nightly
def test_a_killed_session_and_a_new_one_with_the_identity_keep_the_first_table(
    load_table: Load, other: Callable[[], Other]
) -> None:
    other().kill()
    second = other()
    assert loaded().is_identity
    second.end()
    assert is_power(loaded(), 1.1)
    assert kept() == []


@pytest.mark.parametrize("ends", [*nightly("end"), "kill"])
def test_of_two_sessions_the_last_restores(load_table: Load, other: Callable[[], Other], ends: str) -> None:
    first = other()
    with WindowSurface(SIZE_PX, windowed=True, identity=True) as window:
        getattr(first, ends)()
        assert window.gamma_tables()["left"].table.is_identity
    assert is_power(loaded(), 1.1)
    assert kept() == []


@pytest.mark.nightly
def test_what_something_else_has_loaded_meanwhile_stays(load_table: Load, other: Callable[[], Other]) -> None:
    with WindowSurface(SIZE_PX, windowed=True, identity=True):
        load_table(0.7)
    assert is_power(loaded(), 0.7)
    other().kill()
    load_table(1.3)
    with WindowSurface(SIZE_PX, windowed=True) as window:
        assert window.facts.remarks == ()
    assert is_power(loaded(), 1.3)
    assert kept() == []


def test_an_identity_that_is_there_is_left_alone(load_table: Load) -> None:
    load_table(1.0)
    with WindowSurface(SIZE_PX, windowed=True, identity=True) as window:
        assert window.gamma_tables()["left"].table.is_identity
        assert kept() == []


class Screen:
    """A monitor in memory."""

    def __init__(self, exponent: float) -> None:
        self.entries = GammaTable.from_shares(np.linspace(0, 1, 256) ** exponent).entries
        self.broken = False

    def read(self) -> dict[str, LoadedTable]:
        assert self.entries is not None
        return {"DP-1": LoadedTable("DP-1", GammaTable(self.entries), self.entries)}

    def load(self, tables: object) -> None:
        if self.broken:
            raise PresentationError("it does not take it")
        assert isinstance(tables, dict)
        self.entries = np.asarray(tables["DP-1"])


def begun(screen: Screen) -> IdentityTables:
    """The identity loaded on ``screen``."""
    identity = IdentityTables(screen.load)
    identity.load(screen.read()["DP-1"])
    assert screen.read()["DP-1"].table.is_identity
    return identity


def forget(identity: IdentityTables) -> None:
    """Let go of the lock as a dead process does."""
    for lock in identity._held.values():
        lock.release()


def test_each_monitor_gets_its_own_back() -> None:
    powers = {"DP-1": 1.2, "DP-2": 0.8}
    there = {name: GammaTable.from_shares(np.linspace(0, 1, 256) ** power) for name, power in powers.items()}

    def read() -> dict[str, LoadedTable]:
        return {name: LoadedTable(name, table, table.entries) for name, table in there.items()}

    def load(tables: Mapping[str, Entries]) -> None:
        there.update({name: GammaTable(entries) for name, entries in tables.items()})

    identity = IdentityTables(load)
    for before in read().values():
        identity.load(before)
    assert all(table.is_identity for table in there.values())
    forget(identity)
    assert len(restore_left(read, load)) == 2
    assert all(is_power(there[name], power) for name, power in powers.items())
    again = IdentityTables(load)
    for before in read().values():
        again.load(before)
    again.close(read)
    assert all(is_power(there[name], power) for name, power in powers.items())
    assert kept() == []


def test_the_identity_is_refused_where_it_would_not_stay(load_table: Load, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(GlfwSession, "display_server", "cocoa")
    with pytest.raises(PresentationError, match="cannot be loaded as gamma table on cocoa"):
        WindowSurface(SIZE_PX, windowed=True, identity=True)
    monkeypatch.setattr(GlfwSession, "display_server", "wayland")
    with pytest.raises(PresentationError, match="Wayland does not let programs"):
        WindowSurface(SIZE_PX, windowed=True, identity=True)
    monkeypatch.undo()
    assert kept() == []


def test_a_table_of_before_the_machine_was_started_is_not_restored(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Screen(1.2)
    forget(begun(screen))
    monkeypatch.setattr(identity_tables, "boot_id", lambda: boot_id() + "-later")
    assert restore_left(screen.read, screen.load) == ()
    assert screen.read()["DP-1"].table.is_identity
    assert kept() == []


def test_a_monitor_that_does_not_take_the_table_is_tried_again() -> None:
    screen = Screen(1.2)
    identity = begun(screen)
    screen.broken = True
    with pytest.raises(PresentationError, match="does not take it"):
        identity.close(screen.read)
    (remark,) = restore_left(screen.read, screen.load)
    assert "it does not take it" in remark
    screen.broken = False
    (remark,) = restore_left(screen.read, screen.load)
    assert "is loaded again" in remark
    assert is_power(screen.read()["DP-1"].table, 1.2)


def test_a_monitor_that_is_away_gets_its_table_when_it_is_back() -> None:
    screen = Screen(1.2)
    forget(begun(screen))
    assert restore_left(dict, screen.load) == ()
    assert len(restore_left(screen.read, screen.load)) == 1
    assert is_power(screen.read()["DP-1"].table, 1.2)


@pytest.mark.parametrize(
    "text", ["", "[]", '{"monitor": "DP-1"}', '{"monitor": "DP-1", "boot": "x", "entries": [[9]]}']
)
def test_a_damaged_file_is_no_table_and_stops_nothing(text: str) -> None:
    screen = Screen(1.2)
    forget(begun(screen))
    (file,) = tables_folder().glob("*.json")
    file.write_text(text)
    assert restore_left(screen.read, screen.load) == ()
    assert screen.read()["DP-1"].table.is_identity


def test_an_unknown_table_cannot_be_replaced() -> None:
    with pytest.raises(PresentationError, match="Wayland"):
        IdentityTables(Screen(1.2).load).load(LoadedTable.unknown("Wayland has none", "DP-1"))


def test_where_no_file_can_be_written_nothing_is_changed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "state").write_text("a file stands in the way")
    monkeypatch.setenv("CYCLOPEAN_STATE", str(tmp_path / "state"))
    screen = Screen(1.2)
    with pytest.raises(PresentationError, match="CYCLOPEAN_STATE"):
        begun(screen)
    assert is_power(screen.read()["DP-1"].table, 1.2)


def test_tables_of_another_display_server_are_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", ":991")
    screen = Screen(1.2)
    forget(begun(screen))
    monkeypatch.setenv("DISPLAY", ":992.0")
    assert restore_left(screen.read, screen.load) == ()
    monkeypatch.setenv("DISPLAY", ":991.0")
    assert len(restore_left(screen.read, screen.load)) == 1
    assert os.environ["DISPLAY"] == ":991.0"
