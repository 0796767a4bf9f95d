"""Patches shown for an instrument that nothing here drives: by keys, or each for a given time."""

from __future__ import annotations

import csv
import io
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from devices.display import GammaTable
from devices.errors import MeasuringError
from devices.readings import BEFORE_SETTLINGS, Arrangement, PatchEye, Step, steps
from runner.measuring.keys import Keys
from runner.measuring.options import Dialogue, PatchOptions, ShowOptions
from runner.measuring.patch_screen import PatchScreen
from runner.measuring.station import open_screen, table_read_with
from runner.measuring.target import Target, read_target
from runner.presenter.gamma_check import GammaWatch

_BACK = ("left", "page_up", "backspace")
_ON = ("right", "enter", "page_down")


@dataclass(frozen=True, slots=True)
class Shown:
    """The patch that was just shown: the ``number`` of ``of``, and how long the rest takes."""

    step: Step
    number: int
    of: int
    left_s: float
    highest: int


@dataclass(frozen=True, slots=True)
class PatchPlan:
    """Patches to show, in their order, with ``notes`` on what was chosen; ``highest`` is the code of full drive."""

    target: Target
    show: ShowOptions
    order: tuple[Step, ...]
    highest: int
    notes: tuple[str, ...]

    def table(self) -> str:
        """Return the patches in their order as CSV whose X, Y and Z are to be filled in."""
        return patch_table(self.order, self.show.eye, self.target.mode.name, self.target.panel.code_bits)


@dataclass(frozen=True, slots=True)
class PatchesShown:
    """How many patches ``of`` the plan were shown, and the table of them as CSV."""

    shown: int
    of: int
    table: str


def plan_patches(
    rig_or_display: Path, patches: PatchOptions, show: ShowOptions, *, mode: str | None = None, start: str | None = None
) -> PatchPlan:
    """Return the patches to show on a display in their order, from the one labelled ``start`` on.

    Parameters
    ----------
    rig_or_display
        A rig file, or a display file, which needs a ``mode``.
    patches
        The sets of patches.
    show
        How they are shown, and to which eye.
    mode
        The stereo mode; None takes the rig's own.
    start
        The label of the first patch to show; None begins with the first.

    Returns
    -------
    PatchPlan
        The showings in their order, and what to note about the choice.

    Raises
    ------
    InputError
        If a file is wrong, the mode cannot show what was chosen, or there is no such patch.

    Examples
    --------
    >>> plan = plan_patches(Path("configs/rigs/asus_vg248qe_3dvision.yaml"), PatchOptions(), ShowOptions(eye="left"))
    >>> plan.highest, plan.order[0].label
    (255, 'black')
    """
    target = read_target(rig_or_display, mode)
    remark = target.check_eye(show.eye)
    sets, sets_remark = target.sets(patches, show.eye)
    highest = 255 if target.panel.code_bits == 8 else 1023
    order = steps([patch_set.rounded(highest) for patch_set in sets], show.seed, show.repeat_every, eye=show.eye)
    if start is not None:
        labels = [step.label for step in order]
        if start not in labels:
            raise MeasuringError(f"there is no patch '{start}' in this order: see them with --list")
        order = order[labels.index(start) :]
    return PatchPlan(target, show, order, highest, tuple(note for note in (sets_remark, remark) if note))


def show_plan(
    plan: PatchPlan, each_s: float | None, dialogue: Dialogue, on_shown: Callable[[Shown], None]
) -> PatchesShown:
    """Show the patches of ``plan`` full-screen, by keys, or each for ``each_s`` seconds after it has settled.

    Parameters
    ----------
    plan
        What to show, from `plan_patches`.
    each_s
        Seconds for which each patch stays after it has settled, at least 0; None: until a key is pressed.
    dialogue
        How to talk with the person beside the display.
    on_shown
        Called for each patch that stands on the screen.

    Returns
    -------
    PatchesShown
        How many patches were shown, and the table of them as CSV.

    Raises
    ------
    InputError
        If the screen cannot be opened.
    """
    order, show = plan.order, plan.show
    with open_screen(plan.target, show) as screen:
        for warning in screen.surface.facts.remarks:
            dialogue.warn(warning)
        if screen.highest != plan.highest:
            order = tuple(Step(step.position, step.label, step.patch.rounded(screen.highest)) for step in order)
        hold_s = None if each_s is None else show.settle_s + each_s
        watch = GammaWatch(screen.surface.gamma_tables)
        lit = any(loaded.monitor for loaded in watch.loaded.values())
        gamma_table = table_read_with(watch.loaded, show.eye) if lit else None
        times_s = show_patches(screen, order, show.eye, hold_s, dialogue.say, on_shown, show.settle_s)
        if change := watch.change(now=True):
            dialogue.warn(f"{change}; read the patches again")
            gamma_table = GammaTable.unreadable("it changed while the patches were shown")
        table = patch_table(order, show.eye, plan.target.mode.name, screen.surface.bits, times_s, gamma_table)
    return PatchesShown(len(times_s), len(order), table)


def show_patches(
    screen: PatchScreen,
    order: Sequence[Step],
    eye: PatchEye,
    hold_s: float | None,
    say: Callable[[str], None],
    on_shown: Callable[[Shown], None],
    settle_s: float = 0.0,
) -> dict[int, float]:
    """Show ``order`` and return when each was last shown, in seconds from the first, by position.

    Each stands for ``hold_s`` seconds, or until a key if that is None. What a person must move first is announced, and
    with keys stands on the screen until one is pressed. What a patch names to be shown before it stands for
    `BEFORE_SETTLINGS` times ``settle_s``.
    """
    keys = Keys(screen, say)
    times_s: dict[int, float] = {}
    begun_s = time.monotonic()
    index = 0
    stands = Arrangement(eye)
    while index < len(order) and not keys.stops:
        step = order[index]
        if before := step.patch.shown_before:
            screen.show_patch(before, eye)
            keys.wait(BEFORE_SETTLINGS * settle_s)
        screen.show_patch(step.patch, eye)
        wanted = step.patch.arrangement(eye)
        if request := wanted.request(stands):
            if hold_s is not None:
                say(request)
            elif not keys.ask(request):
                break
        stands = wanted
        times_s[step.position] = round(time.monotonic() - begun_s, 3)
        left_s = sum(max(hold_s or 0.0, later.patch.wait_s) for later in order[index:])
        on_shown(Shown(step, index + 1, len(order), left_s, screen.highest))
        wait_s = order[index + 1].patch.wait_s if index + 1 < len(order) else 0.0
        index = max(0, index + _held(keys, None if hold_s is None else max(hold_s, wait_s)))
    return times_s


def patch_table(
    order: Sequence[Step],
    eye: str,
    mode: str,
    bits: int,
    times_s: Mapping[int, float] | None = None,
    gamma_table: GammaTable | None = None,
) -> str:
    """Return what was shown as CSV whose X, Y and Z are to be filled in; all of ``order`` without ``times_s``."""
    highest = (1 << bits) - 1
    out = io.StringIO()
    out.write(f"# codes: 0..{highest}\n# mode: {mode}\n")
    if gamma_table is not None:
        out.write(f"# gamma_table: {gamma_table.to_text()}\n")
    writer = csv.writer(out, lineterminator="\n")
    parts = any(step.patch.filled < 1 for step in order)
    more = [*(["time_s"] if times_s is not None else []), "eye"]
    more += ["area", "surround_red", "surround_green", "surround_blue"] if parts else []
    writer.writerow(["name", "red", "green", "blue", "X", "Y", "Z", *more])
    for step in order:
        if times_s is None or step.position in times_s:
            codes = [round(code * highest) for code in step.patch.codes]
            time_s = [times_s[step.position]] if times_s is not None else []
            around = [step.patch.filled, *(round(code * highest) for code in step.patch.surround)] if parts else []
            writer.writerow([step.patch.name, *codes, "", "", "", *time_s, step.patch.eye or eye, *around])
    return out.getvalue()


def _held(keys: Keys, hold_s: float | None) -> int:
    """Keep the screen until it is time, or a key says so; return by how many patches to move."""
    held_s, last_s = 0.0, time.monotonic()
    while not keys.stops and (hold_s is None or held_s < hold_s):
        key = keys.poll()
        now_s = time.monotonic()
        held_s += 0.0 if keys.paused else now_s - last_s
        last_s = now_s
        if key in _ON:
            return 1
        if key in _BACK:
            return -1
    return 1
