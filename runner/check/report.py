"""What a check is asked to look at, and what it reports: facts, warnings and errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from documents import Finding
from documents.options import MONITOR, Typed
from documents.text import JsonResult

# What a file says, in the order in which it is printed; every value is plain JSON.
Facts = dict[str, Any]
ScreenCheck = Literal["if present", "required", "skip"]
# Beyond this share of pixels the thesis calls an image excessively oversaturated (its footnote 6).
CLIP_LIMIT_PERCENT = 0.3
# Of which is stated what differences a design finds, where nobody says how many are planned.
TRIED_OBSERVERS = 5, 10, 15, 30


@dataclass(frozen=True, slots=True)
class CheckOptions:
    """What else to look at: the results folder, the screen, and the pictures, which may have to be built first.

    Attributes
    ----------
    results
        Folder that the sessions will be written to.
    screen
        Whether it is an error if this screen cannot show the experiment, a warning, or not looked at.
    pictures
        Build the stimuli; without, clipping is not reported.
    clip_limit_percent
        Percentage of an eye's clipped pixels above which a stimulus gets a warning; 0.3 is the thesis's.
    accept_gamma_table
        Make it a warning, not an error, if the graphics card's gamma table is not the measured one.
    accept_changes
        Make it a warning, not an error, if experiment, stimuli, display or rig changed since the sessions before.
    mode
        Stereo mode to use instead of the rig's, as `cyclopean run --mode`.
    allow_uncharacterised
        Use another mode's characterisation if this mode has none.
    budget
        Report what each step from a picture's file to the eye costs in ΔE00, of a rig or an experiment.
    observers
        Number of observers planned: what differences an experiment finds with them; repeat for several. Default: 5,
        10, 15 and 30.
    monitors
        Monitor for the window, as `cyclopean doctor` lists them; twice for dual-window, the left eye's first. Default:
        the rig's, else the first of the panel's resolution.
    progress
        Called with what is being done, how much of it is done, and of how much.
    """

    results: Path = Path("results")
    screen: ScreenCheck = "if present"
    pictures: bool = True
    clip_limit_percent: Annotated[float, Typed("--clip-limit", "PERCENT", 0, 100)] = CLIP_LIMIT_PERCENT
    accept_gamma_table: bool = False
    accept_changes: bool = False
    mode: str | None = None
    allow_uncharacterised: bool = False
    budget: bool = False
    observers: Annotated[tuple[int, ...], Typed(least=2, most=1000)] = ()
    monitors: Annotated[tuple[str, ...], MONITOR] = ()
    progress: Callable[[str, int, int], None] = lambda what, done, of: None


@dataclass(frozen=True, slots=True)
class CheckReport(JsonResult):
    """A file's ``facts``; ``warnings`` are to be thought about, ``errors`` keep a session from running.

    `check_file` fills it as it reads.
    """

    file: Path
    facts: Facts = field(default_factory=dict)
    warnings: list[Finding] = field(default_factory=list)
    errors: list[Finding] = field(default_factory=list)
    json_keys: ClassVar = {"facts": "*", "errors": "findings"}
