"""Session logs damaged in every way that leaves them JSON: bits, keys, types, ranges, order, and lines of others.

A mutant is made from a log's lines by one change, drawn with a seed, so that whoever finds one can make it again.
"""

from __future__ import annotations

import copy
import json
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

Lines = list[dict[str, Any]]
Change = Callable[[Lines, random.Random], None]

_ODD_VALUES: tuple[Any, ...] = (
    *(None, True, -1, 0, 7, 2.5, -5.0, 1e9, 1e300, 10**30, float("nan"), float("inf")),
    *("", "x", "\ud800", "a" * 5000, [], [1], [[]], {}, {"a": 1}, {"left": 1}),
)


@dataclass(frozen=True, slots=True)
class Mutant:
    """A log with one change: its name, the seed that makes it again, and the bytes."""

    change: str
    seed: int
    content: bytes


def mutants(content: bytes, seeds: Sequence[int], changes: Sequence[str] = ()) -> Iterator[Mutant]:
    """Yield a mutant of a log without checksums for each of the seeds; some change nothing and are left out."""
    names = list(changes or CHANGES)
    for seed in seeds:
        rng = random.Random(seed)
        name = names[seed % len(names)]
        if name == "flip a bit":
            mutated = _flip(content, rng)
        else:
            lines = [json.loads(line) for line in content.splitlines()]
            CHANGES[name](lines, rng)
            mutated = written(lines)
        if mutated != content:
            yield Mutant(name, seed, mutated)


def written(lines: Lines) -> bytes:
    """Return a log of these lines."""
    text = "".join(json.dumps(line, ensure_ascii=False, separators=(",", ":")) + "\n" for line in lines)
    return text.encode("utf-8", "backslashreplace")


def _flip(content: bytes, rng: random.Random) -> bytes:
    """Flip a bit so that the line is JSON still, in a trial nine times of ten."""
    lines = content.split(b"\n")
    trials = [number for number, line in enumerate(lines) if line.startswith(b'{"record":"trial"')]
    for _ in range(1000):
        number = rng.choice(trials) if rng.random() < 0.9 else rng.randrange(len(lines) - 1)
        line = bytearray(lines[number])
        line[rng.randrange(len(line))] ^= 1 << rng.randrange(8)
        try:
            json.loads(bytes(line))
        except (ValueError, RecursionError):
            continue
        if b"\n" not in line:
            return b"\n".join([*lines[:number], bytes(line), *lines[number + 1 :]])
    return content


def _places(value: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in inside:
        yield (*place, key)
        yield from _places(inner, (*place, key))


def _somewhere(lines: Lines, rng: random.Random) -> tuple[Any, Any]:
    """Return something that holds values, and the key of one of them."""
    line = rng.choice(lines) if rng.random() < 0.7 else lines[0]
    *place, key = rng.choice(list(_places(line)))
    inside: Any = line
    for step in place:
        inside = inside[step]
    return inside, key


def _trial(lines: Lines, rng: random.Random) -> dict[str, Any]:
    return rng.choice([line for line in lines if line["record"] == "trial"])


def _remove(lines: Lines, rng: random.Random) -> None:
    inside, key = _somewhere(lines, rng)
    del inside[key]


def _replace(lines: Lines, rng: random.Random) -> None:
    inside, key = _somewhere(lines, rng)
    inside[key] = copy.deepcopy(rng.choice(_ODD_VALUES))


def _exchange(lines: Lines, rng: random.Random) -> None:
    (one, key), (other, other_key) = _somewhere(lines, rng), _somewhere(lines, rng)
    one[key], other[other_key] = copy.deepcopy(other[other_key]), copy.deepcopy(one[key])


def _nest(lines: Lines, rng: random.Random) -> None:
    inside, key = _somewhere(lines, rng)
    for _ in range(rng.choice((5, 50, 300))):
        inside[key] = [inside[key]] if rng.random() < 0.5 else {"a": inside[key]}


def _rename(lines: Lines, rng: random.Random) -> None:
    inside, key = _somewhere(lines, rng)
    if isinstance(inside, dict):
        inside[rng.choice((f"{key}s", "", "x", key[:-1], "\ud800"))] = inside.pop(key)


def _add(lines: Lines, rng: random.Random) -> None:
    rng.choice(lines)[rng.choice(("catch", "group", "ratings", "timed", "x", "outcome", "nominal"))] = rng.choice(
        _ODD_VALUES
    )


def _delete(lines: Lines, rng: random.Random) -> None:
    del lines[rng.randrange(len(lines))]


def _exchange_lines(lines: Lines, rng: random.Random) -> None:
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[i], lines[j] = lines[j], lines[i]


def _repeat(lines: Lines, rng: random.Random) -> None:
    lines.insert(rng.randrange(1, len(lines) + 1), copy.deepcopy(rng.choice(lines)))


def _append_another(lines: Lines, rng: random.Random) -> None:
    other = copy.deepcopy(lines)
    other[0]["observer"] = "99"
    lines += other[rng.choice((0, 1)) :]


def _record(lines: Lines, rng: random.Random) -> None:
    kinds = ("triad", "", 7, None, "session", "end", "note", "mark", "resume", "trial")
    rng.choice(lines)["record"] = rng.choice(kinds)


def _schema(lines: Lines, rng: random.Random) -> None:
    lines[0]["schema_version"] = rng.choice((99, 0, -1, "1", 1.5, None, True))


def _swap_choice(lines: Lines, rng: random.Random) -> None:
    chosen = [line for line in lines if line.get("rejected")]
    if chosen:
        line = rng.choice(chosen)
        line["chosen"], line["rejected"] = line["rejected"], line["chosen"]
        if rng.random() < 0.5:
            line["answer"] = "second" if line["answer"] == "first" else "first"


def _response_time(lines: Lines, rng: random.Random) -> None:
    _trial(lines, rng)["response_time_s"] = rng.choice((-5, 1e9, float("nan"), float("inf"), 0, 17.25, "1", None))


def _number(lines: Lines, rng: random.Random) -> None:
    _trial(lines, rng)[rng.choice(("block", "trial", "attempt"))] = rng.choice((-1, 0, 1, 2, 5, 10**9, 1.0, "0"))


def _stimulus(lines: Lines, rng: random.Random) -> None:
    line = _trial(lines, rng)
    names = [key for key in ("first", "second", "chosen", "rejected", "stimulus") if key in line]
    if names:
        line[rng.choice(names)] = rng.choice(("a", "b", "zebra", "", 3))


def _time(lines: Lines, rng: random.Random) -> None:
    line = rng.choice([line for line in lines if "utc" in line])
    line["utc"] = rng.choice(("", "soon", "2026-13-01T00:00:00Z", "1999-01-01T00:00:00+00:00", "2026-11-24", 7, None))


def _event(lines: Lines, rng: random.Random) -> None:
    events = [line for line in lines if line.get("events")]
    event = rng.choice(rng.choice(events)["events"])
    event[rng.randrange(2)] = rng.choice(("up", "down", "", 1.0, -1.0, float("nan"), 9.5, None))


CHANGES: dict[str, Change] = {
    "flip a bit": lambda lines, rng: None,
    "remove a key": _remove,
    "replace a value": _replace,
    "exchange two values": _exchange,
    "nest a value": _nest,
    "rename a key": _rename,
    "add a key": _add,
    "delete a line": _delete,
    "exchange two lines": _exchange_lines,
    "repeat a line": _repeat,
    "append another's lines": _append_another,
    "another record": _record,
    "another version": _schema,
    "swap chosen and rejected": _swap_choice,
    "another response time": _response_time,
    "another number": _number,
    "another stimulus": _stimulus,
    "another time": _time,
    "another event": _event,
}
