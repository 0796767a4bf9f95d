"""What this machine can do: graphics, stereo modes, folders, and where the packages come from."""

from __future__ import annotations

import importlib
import os
import platform
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from devices.display.rig_file import Rig
from runner.presenter.modes.registry import MODES, available
from runner.presenter.surfaces.screens import compositor
from runner.presenter.surfaces.surface import BACKENDS, Buffer, open_surface
from runner.session.header import software
from runner.session.timing_record import explain, judge, swap_intervals, swaps_per_second

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


def examine_timing(seconds: float, progress: Callable[[float], None], rig: Rig | None = None) -> dict[str, Any]:
    """Open a window, swap it for ``seconds`` and return the intervals with what they mean.

    With ``rig``, they also say whether its record of a photodiode's verification holds here.

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
    verification = rig.photodiode_verification if rig else None
    judgement = judge(verification, rig.mode if rig else "", facts, swaps_per_second(summary))
    return {
        "display_server": facts.display_server,
        "renderer": facts.renderer,
        "compositor": compositor(),
        "swap_intervals": asdict(summary),
        "verification": judgement.words,
        "meaning": explain(summary, facts.vsync, judgement),
    }


def _packages() -> dict[str, Any]:
    """Flat package names can be taken by others: say where each is imported from."""
    root = Path(__file__).resolve().parents[2]
    found: dict[str, Any] = {}
    for name in _PACKAGES:
        file = importlib.import_module(name).__file__
        place = Path(file).resolve().parents[1] if file else None
        problem = None if place == root else f"imported from {place}, not from {root}: another distribution hides it"
        found[name] = {"folder": str(place), "problem": problem}
    return found


def _surface(backend: str) -> dict[str, Any]:
    """Open a small surface, and once more asking for stereo where it may have it, and for codes of 10 bits."""
    try:
        with open_surface(backend, _SIZE_PX, stereo=False, windowed=True) as surface:
            facts = asdict(surface.facts)
            modes = available(surface)
    except Exception as error:
        return {"problem": str(error), "facts": None, "modes": {}, "ten_bits": None}
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
    return {"problem": None, "facts": facts, "modes": modes, "ten_bits": _ten_bits(backend)}


def _ten_bits(backend: str) -> dict[str, Any]:
    """Say whether the surface has codes of 10 bits when it is asked for them, and why not."""
    try:
        with open_surface(backend, _SIZE_PX, windowed=True, bits=10) as surface:
            facts = surface.facts
    except Exception as error:
        return {"given": False, "problem": str(error)}
    given = facts.bits == 10
    return {"given": given, "problem": None if given else "; ".join(facts.remarks) or f"codes have {facts.bits} bits"}
