"""Ctrl-C while the window library runs: it is heard once, after the library has returned, and never lost."""

from __future__ import annotations

import ctypes
import signal
import threading
from collections.abc import Iterator

import pytest

from runner.presenter.surfaces.glfw_session import SignalWake


@pytest.fixture
def woken() -> Iterator[threading.Event]:
    """Set by each waking."""
    yield threading.Event()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.fixture
def signals(woken: threading.Event) -> Iterator[SignalWake]:
    """What wakes for signals, and is closed afterwards."""
    opened = SignalWake(woken.set)
    yield opened
    opened.close()


def test_ctrl_c_in_a_callback_of_the_library_is_not_lost(signals: SignalWake, woken: threading.Event) -> None:
    went_on: list[bool] = []

    def called_back() -> None:
        signal.raise_signal(signal.SIGINT)
        went_on.append(True)

    with pytest.raises(KeyboardInterrupt):
        signals.heard(ctypes.CFUNCTYPE(None)(called_back))
    assert went_on == [True]
    assert woken.wait(60)
    signals.heard(int)  # once was enough


def test_ctrl_c_outside_the_library_is_heard_at_once(signals: SignalWake) -> None:
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
    signals.heard(int)


def test_ctrl_c_wakes_what_sleeps_in_the_library(signals: SignalWake, woken: threading.Event) -> None:
    def sleep() -> None:
        threading.Timer(0.05, signal.raise_signal, (signal.SIGINT,)).start()
        assert woken.wait(60)

    with pytest.raises(KeyboardInterrupt):
        signals.heard(sleep)
