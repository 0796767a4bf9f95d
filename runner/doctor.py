"""What this machine can do: graphics, stereo modes, folders, and where the packages come from."""

from __future__ import annotations

import importlib
import os
import platform
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from runner.header import software
from runner.presenter.compositor import compositor
from runner.presenter.modes.registry import MODES, available
from runner.presenter.surfaces.open import BACKENDS, open_surface
from runner.presenter.surfaces.surface import Buffer
from runner.timing_record import explain, swap_intervals

_SIZE_PX = (640, 480)
_PACKAGES = ("documents", "devices", "stimuli", "analysis", "runner")


def examine() -> dict[str, Any]:
    """Return facts about the machine; every ``problem`` in them is a sentence, or None."""
    return {
        "software": software(),
        "packages": _packages(),
        "surfaces": {backend: _surface(backend) for backend in BACKENDS},
        "processors": os.cpu_count(),
        "machine": platform.machine(),
    }


def examine_timing(seconds: float, progress: Callable[[float], None]) -> dict[str, Any]:
    """Open a window, swap it for ``seconds`` and return the intervals with what they mean.

    Raises
    ------
    InputError
        If there is no screen.
    """
    with open_surface("window", _SIZE_PX, windowed=True) as surface:
        facts = surface.facts

        def frame() -> None:
            surface.target(Buffer.BACK).clear()
            surface.swap()

        summary = swap_intervals(frame, seconds, progress)
    return {
        "display_server": facts.display_server,
        "renderer": facts.renderer,
        "compositor": compositor(),
        "swap_intervals": asdict(summary),
        "meaning": explain(summary, facts.vsync),
    }


def _packages() -> dict[str, Any]:
    """Flat package names can be taken by others: say where each is imported from."""
    root = Path(__file__).resolve().parents[1]
    found: dict[str, Any] = {}
    for name in _PACKAGES:
        file = importlib.import_module(name).__file__
        place = Path(file).resolve().parents[1] if file else None
        problem = None if place == root else f"imported from {place}, not from {root}: another distribution hides it"
        found[name] = {"folder": str(place), "problem": problem}
    return found


def _surface(backend: str) -> dict[str, Any]:
    """Open a small surface, and once more asking for stereo where it may have it."""
    try:
        with open_surface(backend, _SIZE_PX, stereo=False, windowed=True) as surface:
            facts = asdict(surface.facts)
            modes = available(surface)
    except Exception as error:
        return {"problem": str(error), "facts": None, "modes": {}}
    if backend == "window":
        try:
            with open_surface(backend, _SIZE_PX, stereo=True, windowed=True) as surface:
                modes = available(surface)
        except Exception as error:
            modes["quad-buffered"] = str(error)
    for name in [name for name, make in MODES.items() if make().windows > 1]:
        try:
            with open_surface(backend, _SIZE_PX, windows=MODES[name]().windows, windowed=True) as surface:
                modes[name] = available(surface)[name]
        except Exception as error:
            modes[name] = str(error)
    return {"problem": None, "facts": facts, "modes": modes}
