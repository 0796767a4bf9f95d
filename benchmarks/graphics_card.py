"""Absolute times with the driver that EGL gives: a steady frame, a switch, the colour pass, and an upload.

    python benchmarks/graphics_card.py

It needs EGL and nothing else: no window, no X server. Ratios are in `colour_pass`; what a frame takes depends on the
card and its driver, which stand in the title and beside every time. Software OpenGL is measured likewise and called so.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from colour_pass import GAMMA, SIZE_PX, in_turn, model, test_picture
from curves import program, row
from promises import Promise

from analysis.records import SurfaceFacts
from devices.display.display_file import EyeModels
from runner.presenter.colour_pass import ColourPass, release_codes
from runner.presenter.modes.registry import find_mode
from runner.presenter.presenter import Presenter
from runner.presenter.surfaces.opening import open_surface
from runner.presenter.surfaces.surface import Buffer, Surface
from runner.scene import Picture, Scene
from stimuli.pictures.stereo_image import StereoImage

FRAME_120_HZ_MS = 1000.0 / 120.0
SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader")


def is_software(facts: SurfaceFacts) -> bool:
    """Return whether a processor draws, and no graphics card."""
    return any(name in facts.renderer.lower() for name in SOFTWARE)


def times_ms(surface: Surface) -> dict[str, float]:
    """Return what each takes in milliseconds, until the driver says that it is done."""
    context = surface.context
    display = model(GAMMA)
    width = SIZE_PX[0]
    XYZ = test_picture(display)
    halves = [np.ascontiguousarray(XYZ[:, : width // 2]), np.ascontiguousarray(XYZ[:, width // 2 :])]
    pictures = {"a": StereoImage(*halves), "b": StereoImage(*reversed(halves))}
    uploaded = context.texture(SIZE_PX, 3, XYZ, alignment=1, dtype="f4")
    colour_pass = ColourPass(context, display)

    def upload() -> None:
        texture = context.texture(SIZE_PX, 3, XYZ, alignment=1, dtype="f4")
        context.finish()
        texture.release()

    def whole_pass() -> None:
        surface.target(Buffer.BACK)
        release_codes(colour_pass.run(uploaded))
        context.finish()

    scenes = [Scene((Picture(name),)) for name in pictures]
    with Presenter(surface, find_mode("side-by-side"), EyeModels(display, display), pictures.__getitem__) as presenter:
        for scene in scenes:
            presenter.prefetch(scene)

        def steady() -> None:
            presenter.redraw()
            context.finish()

        def there_and_back() -> None:
            for scene in scenes:
                presenter.show(scene)
                context.finish()

        presenter.show(scenes[-1])
        work = {
            "steady frame": steady,
            "switch, pictures prefetched": there_and_back,
            "colour pass": whole_pass,
            "upload": upload,
        }
        times = {name: 1000.0 * time_s for name, time_s in in_turn(work, rounds=31).items()}
    times["switch, pictures prefetched"] /= len(scenes)
    return times


def run() -> dict[str, Any]:
    """Measure on the driver that this machine gives; a frame and a switch within one frame of 120 Hz are the goal."""
    with open_surface("egl", SIZE_PX) as surface:
        facts = surface.facts
        times = times_ms(surface)
    driver = f"{facts.renderer}, {facts.gl_version}"
    kind = "software OpenGL" if is_software(facts) else "a graphics card"
    size = f"{SIZE_PX[0]} × {SIZE_PX[1]} pixels"
    rows = [row(name, size, time_ms / 1000.0, note=f"{kind}: {driver}") for name, time_ms in times.items()]
    promises = []
    for name, time_ms in times.items():
        goal_ms = FRAME_120_HZ_MS if name.startswith(("steady", "switch")) else None
        figure, why = (None, f"no graphics card: {facts.renderer}") if is_software(facts) else (time_ms, "")
        promises.append(Promise(name, figure, goal_ms, "seconds", unit="ms", missing=why))
    return {"title": f"Absolute times with {kind}: {driver}", "rows": rows, "promises": promises}


if __name__ == "__main__":
    program("graphics_card", run)
