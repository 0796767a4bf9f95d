"""Patches shown for an instrument that nothing here drives: by keys, or each for a given time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from analysis.records import duration
from devices.display import GammaTable
from devices.errors import MeasuringError
from devices.readings import BEFORE_SETTLINGS, Arrangement, PatchTurn, steps
from documents import Finding, WorkError
from documents.files import write_whole, writing
from documents.tables import csv_lines
from documents.text import JsonResult
from runner.measuring.keys import Keys
from runner.measuring.options import Dialogue, PatchesOptions, ShowPatches
from runner.measuring.patch_screen import PatchScreen
from runner.measuring.station import open_screen, table_read_with
from runner.measuring.target import Target, read_target
from runner.presenter.gamma_check import GammaWatch

_BACK = ("left", "page_up", "backspace")
_ON = ("right", "enter", "page_down")


@dataclass(frozen=True, slots=True)
class PatchesShown(JsonResult):
    """How many patches ``of`` those asked for were ``shown``, and the ``table`` of them: CSV to fill X, Y and Z in.

    ``output`` is the file that it was written into; ``list_only`` whether none was to be shown.
    """

    shown: int
    of: int
    table: str
    output: Path | None = None
    list_only: bool = False
    json_keys: ClassVar = {"output": "table"}
    json_names: ClassVar = "shown of output"

    @property
    def failure(self) -> WorkError | None:
        """What to raise where it was stopped."""
        stopped = self.shown < self.of and not self.list_only
        return WorkError(f"stopped after {self.shown} of {self.of} patches") if stopped else None

    @property
    def words_only(self) -> bool:
        """Whether it is the table that is printed, as JSON too."""
        return self.list_only

    def told(self) -> Iterator[str]:
        """Yield the table, if it is all that was asked for."""
        if self.list_only:
            yield self.table.removesuffix("\n")


def show_patches(
    rig_or_display: Path, options: PatchesOptions | None = None, dialogue: Dialogue | None = None
) -> PatchesShown:
    """Show patches of known device codes full-screen in a stereo mode.

    Both eyes see them, or one while the other sees black, so that the mode stays enabled. Right and left show the next
    and the previous patch, space pauses, Escape stops. The order is shuffled by the seed; black and white come again
    throughout.

    Parameters
    ----------
    rig_or_display
        A rig file, or a display file, which needs a mode.
    options
        The sets of patches, how they are shown, and to which eye; without a window, for how long each.
    dialogue
        How to talk with the person beside the display; None: not at all.

    Returns
    -------
    PatchesShown
        How many patches were shown, and the table of them as CSV.

    Raises
    ------
    InputError
        If a file is wrong, the mode cannot show what was chosen, or the screen cannot be opened.
    WorkError
        If the table cannot be written.

    Examples
    --------
    >>> options = PatchesOptions(list_only=True, start="white#2")
    >>> listed = show_patches(Path("configs/rigs/asus_vg248qe_3dvision.yaml"), options)
    >>> listed.of, listed.table.splitlines()[3]
    (125, 'white,255,255,255,,,,both')
    """
    options, dialogue = options or PatchesOptions(), dialogue or Dialogue()
    show = options.show
    if show.backend != "window" and options.each_s is None and not options.list_only:
        raise MeasuringError(Finding("without a window there are no keys", remedy="add --each S"))
    target = read_target(rig_or_display, options.mode)
    remark = target.check_eye(show.eye)
    sets, sets_remark = target.sets(options.patches, show.eye)
    bits = target.panel.code_bits
    rounded = [patch_set.rounded((1 << bits) - 1) for patch_set in sets]
    order = _from(options.start, steps(rounded, show.seed, show.repeat_every, eye=show.eye))
    dialogue.note(sets_remark)
    dialogue.note(remark)
    if options.list_only:
        return PatchesShown(0, len(order), patch_table(order, show.eye, target.mode.name, bits), list_only=True)
    shown, table = _show(target, order, options, dialogue)
    if options.output is not None:
        with writing(options.output, "table", WorkError):
            write_whole(options.output, table, make_folder=False)
    return PatchesShown(shown, len(order), table, options.output)


def _from(start: str | None, order: tuple[PatchTurn, ...]) -> tuple[PatchTurn, ...]:
    """Return ``order`` from the step labelled ``start`` on; all of it without one."""
    labels = [step.label for step in order]
    if start is not None and start not in labels:
        raise MeasuringError(f"there is no patch '{start}' in this order: see them with --list")
    return order if start is None else order[labels.index(start) :]


def _show(target: Target, order: tuple[PatchTurn, ...], options: PatchesOptions, dialogue: Dialogue) -> tuple[int, str]:
    """Show ``order``, and return how many were shown and the table of them."""
    show = options.show
    with open_screen(target, show) as screen:
        for warning in screen.surface.facts.remarks:
            dialogue.warn(warning)
        if screen.surface.bits != target.panel.code_bits:
            order = tuple(PatchTurn(step.position, step.label, step.patch.rounded(screen.highest)) for step in order)
        hold_s = None if options.each_s is None else show.settle_s + options.each_s
        watch = GammaWatch(screen.surface.gamma_tables)
        lit = any(loaded.monitor for loaded in watch.loaded.values())
        gamma_table = table_read_with(watch.loaded, show.eye) if lit else None
        times_s = _show_each(screen, order, show, hold_s, dialogue.say)
        if change := watch.change(now=True):
            dialogue.warn(f"{change}; read the patches again")
            gamma_table = GammaTable.unreadable("it changed while the patches were shown")
        return len(times_s), patch_table(order, show.eye, target.mode.name, screen.surface.bits, times_s, gamma_table)


def _show_each(
    screen: PatchScreen, order: Sequence[PatchTurn], show: ShowPatches, hold_s: float | None, say: Callable[[str], None]
) -> dict[int, float]:
    """Show ``order``, say each, and return when it was last shown, in seconds from the first, by position.

    Each stands for ``hold_s`` seconds, or until a key if that is None. What a person must move first is announced, and
    with keys stands on the screen until one is pressed. What a patch names to be shown before it stands for
    `BEFORE_SETTLINGS` times the settling time.
    """
    eye = show.eye
    keys = Keys(screen, say)
    times_s: dict[int, float] = {}
    begun_s = time.monotonic()
    index = 0
    stands = Arrangement(eye)
    while index < len(order) and not keys.stops:
        step = order[index]
        if before := step.patch.shown_before:
            screen.show_patch(before, eye)
            keys.wait(BEFORE_SETTLINGS * show.settle_s)
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
        codes = " ".join(f"{round(code * screen.highest)}" for code in step.patch.codes)
        left = "" if hold_s is None else f", {duration(round(left_s))} left"
        say(f"{index + 1}/{len(order)}  {step.label}: {codes}{left}")
        wait_s = order[index + 1].patch.wait_s if index + 1 < len(order) else 0.0
        index = max(0, index + _held(keys, None if hold_s is None else max(hold_s, wait_s)))
    return times_s


def patch_table(
    order: Sequence[PatchTurn],
    eye: str,
    mode: str,
    bits: int,
    times_s: Mapping[int, float] | None = None,
    gamma_table: GammaTable | None = None,
) -> str:
    """Return what was shown as CSV whose X, Y and Z are to be filled in; all of ``order`` without ``times_s``."""
    highest = (1 << bits) - 1
    head = f"# codes: 0..{highest}\n# mode: {mode}\n"
    if gamma_table is not None:
        head += f"# gamma_table: {gamma_table.to_text()}\n"
    parts = any(step.patch.filled < 1 for step in order)
    more = [*(["time_s"] if times_s is not None else []), "eye"]
    more += ["area", "surround_red", "surround_green", "surround_blue"] if parts else []
    rows: list[list[object]] = [["name", "red", "green", "blue", "X", "Y", "Z", *more]]
    for step in order:
        if times_s is None or step.position in times_s:
            codes = [round(code * highest) for code in step.patch.codes]
            time_s = [times_s[step.position]] if times_s is not None else []
            around = [step.patch.filled, *(round(code * highest) for code in step.patch.surround)] if parts else []
            rows.append([step.patch.name, *codes, "", "", "", *time_s, step.patch.eye or eye, *around])
    return head + csv_lines(rows)


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
