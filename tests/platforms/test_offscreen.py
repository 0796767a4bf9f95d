"""Pictures without a window where there is no EGL, and the windows that macOS gives."""

from __future__ import annotations

import glfw
import numpy as np
import pytest

from runner.presenter import Buffer
from runner.presenter.surfaces import egl, glfw_session


@pytest.mark.parametrize("bits", [8, 10])
def test_a_surface_is_drawn_to_and_read_without_egl(xvfb: str, monkeypatch: pytest.MonkeyPatch, bits: int) -> None:
    """By the system's own library, as on Windows and macOS: here that is GLX."""
    monkeypatch.setenv("DISPLAY", xvfb)
    monkeypatch.setattr(egl, "sys", type("System", (), {"platform": "darwin"}))
    monkeypatch.setattr("ctypes.CDLL", lambda name: pytest.fail(f"{name} is called"))
    with egl.EglSurface((16, 8), 2, 10 if bits == 10 else 8) as surface:
        assert surface.facts.backend == "cgl"
        for buffer, red in ((Buffer.BACK_LEFT, 1.0), (Buffer.BACK_RIGHT, 0.2)):
            surface.target(buffer).clear(red, 0.0, 0.4)
        surface.swap()
        full = 2**surface.bits - 1
        assert np.all(surface.read("left") == [full, 0, round(0.4 * full)])
        assert np.all(surface.read("right") == [round(0.2 * full), 0, round(0.4 * full)])


@pytest.mark.parametrize(("system", "forward"), [("darwin", True), ("win32", False), ("linux", False)])
def test_macos_is_asked_for_the_profile_that_it_has(
    system: str, forward: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(glfw_session, "sys", type("System", (), {"platform": system}))
    assert (glfw_session.context_hints().get(glfw.OPENGL_FORWARD_COMPAT) == glfw.TRUE) == forward
