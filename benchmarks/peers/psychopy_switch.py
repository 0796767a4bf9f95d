"""One side of the trial-switch benchmark: PsychoPy's ImageStim, run by `trial_switch.py` in PsychoPy's own environment.

Takes a folder of PNG pictures named left-N.png and right-N.png and a number of frames; prints one line of JSON with the
seconds of each steady frame and of each switch.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path


def main(folder: Path, frames: int) -> None:
    """Show the pictures side by side in a window of 1920 × 1080; time steady frames, then switches of pictures."""
    from psychopy import logging, visual

    logging.console.setLevel(logging.CRITICAL)
    window = visual.Window((1920, 1080), fullscr=False, units="pix", color=(-1, -1, -1), waitBlanking=False)
    pairs = sorted(folder.glob("left-*.png"))
    stimuli = [
        [
            visual.ImageStim(window, image=str(folder / f"{eye}-{number}.png"), pos=(x, 0), size=(960, 1080))
            for eye, x in (("left", -480), ("right", 480))
        ]
        for number in range(len(pairs))
    ]
    finish = _finish()

    def show(pair: list[visual.ImageStim]) -> float:
        began = time.perf_counter()
        for stimulus in pair:
            stimulus.draw()
        window.flip()
        finish()
        return time.perf_counter() - began

    for pair in stimuli:
        show(pair)
    steady = [show(stimuli[0]) for _ in range(frames)]
    prefetched = [show(stimuli[frame % len(stimuli)]) for frame in range(frames)]
    changing = []
    for frame in range(frames):
        began = time.perf_counter()
        for eye, stimulus in zip(("left", "right"), stimuli[0], strict=True):
            stimulus.image = str(folder / f"{eye}-{frame % len(stimuli)}.png")
        show(stimuli[0])
        changing.append(time.perf_counter() - began)
    print(json.dumps({"steady": steady, "prefetched": prefetched, "set_image": changing}))


def _finish() -> object:
    from pyglet import gl

    return gl.glFinish


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
