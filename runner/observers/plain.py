"""The simplest answers: those of a preview, and the fallback of other observers."""

from __future__ import annotations

from runner.blocks.tasks import Browse, Choose, Compare, Rate, Write
from runner.ports import Ask


def key_for(ask: Ask, meaning: str) -> str:
    """Return something that an observer can do to mean ``meaning``.

    Raises
    ------
    ValueError
        If nothing means that here.
    """
    for key, meant in ask.keys.items():
        if meant == meaning:
            return key
    if meaning in ask.targets:
        return f"click {meaning}"
    if ask.typing and ask.meaning(meaning) == meaning:
        return meaning
    raise ValueError(f"nothing means '{meaning}' here, only {sorted({*ask.keys.values(), *ask.targets})}")


def plain_key(ask: Ask) -> str:
    """Return a press that continues: the first of two, the last of a series, the middle of a scale, what is right."""
    return key_for(ask, _meaning(ask))


def _meaning(ask: Ask) -> str:
    task = ask.task
    means = {*ask.keys.values(), *ask.targets}
    if isinstance(task, Compare):
        return "first"
    if isinstance(task, Browse):
        return "choose" if "choose" in means and len(task.seen) == len(task.series) else unseen(task)
    if isinstance(task, Rate):
        middle = (task.lowest + task.highest) // 2
        if task.current is None:
            return str(middle) if str(middle) in means else "higher"
        return "accept"
    if isinstance(task, Choose):
        return task.correct or task.options[0]
    if isinstance(task, Write):
        return "accept" if "accept" in means else _next_character(task)
    return next(iter([*ask.keys.values(), *ask.targets]))


def _next_character(task: Write) -> str:
    """Return what gets nearer to the example: its next character, or erasing what is not part of it."""
    if not task.example.startswith(task.typed):
        return "erase"
    return f"text {task.example[len(task.typed) :][:1] or '1'}"


def unseen(task: Browse) -> str:
    """Return the way to the nearest picture of a series that was not seen yet."""
    ahead = [index for index in range(task.index + 1, len(task.series)) if index not in task.seen]
    return "next" if ahead else "previous"
