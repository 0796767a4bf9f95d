"""What a check is asked to look at, and what it reports: facts, warnings and errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from documents import Finding

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

    What changed since the sessions in that folder is an error, unless to ``accept_changes``: then a warning.
    A gamma table that is not the measured one is an error, unless ``accept_gamma_table``: then a warning.
    ``mode`` is shown instead of the rig's, and ``allow_uncharacterised`` lets it use another mode's measurements.
    ``monitors`` are those for the window, by name or number, in place of the rig's.
    ``budget`` asks for what each step from a picture's file to the eye costs, of an experiment or a rig.
    ``observers`` are numbers of them, of each of which is stated what differences the design finds.
    A stimulus of which more than ``clip_limit_percent`` of an eye's pixels are clipped gets a warning.
    """

    results: Path = Path("results")
    screen: ScreenCheck = "if present"
    pictures: bool = True
    clip_limit_percent: float = CLIP_LIMIT_PERCENT
    accept_gamma_table: bool = False
    mode: str | None = None
    allow_uncharacterised: bool = False
    progress: Callable[[str, int, int], None] = lambda what, done, of: None
    monitors: tuple[str, ...] = ()
    budget: bool = False
    accept_changes: bool = False
    observers: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class CheckReport:
    """A file's ``facts``; ``warnings`` are to be thought about, ``errors`` keep a session from running.

    `check_file` fills it as it reads.
    """

    file: Path
    facts: Facts = field(default_factory=dict)
    warnings: list[Finding] = field(default_factory=list)
    errors: list[Finding] = field(default_factory=list)

    def to_json(self) -> Facts:
        """Return all of it; errors are called ``findings``."""
        return {
            "file": str(self.file),
            **self.facts,
            "warnings": [asdict(finding) for finding in self.warnings],
            "findings": [asdict(finding) for finding in self.errors],
        }
