"""Mutants: files that were right and were changed in a few places, read in processes that are watched.

A mutant is its format and a number; the same number makes the same bytes on every machine. Each is read in a child
process, many in one, with warnings as errors: it must be read or refused by an `InputError` whose findings are one line
each, within 10 s of computing and 1 GB. What crashes the child or keeps it busy is named as well, and the rest go on
in another.

A module with formats has ``FORMATS``, a tuple of `Format`. Run by hand, and again for one mutant:

    python -m tests.stress.mutants tests.stress.foreign_formats mat 0 1000
    python -m tests.stress.mutants tests.stress.foreign_formats mat 137
"""

from __future__ import annotations

import contextlib
import importlib
import json
import queue
import random
import re
import subprocess
import sys
import tempfile
import threading
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from documents import InputError
from documents.text import hidden_character
from tests.kept import known

ROOT = Path(__file__).parents[2]
MOST_S, MOST_BYTES = 10.0, 1 << 30
PATIENCE_S = 180.0  # of the clock on the wall, without a sign of the child: other work may keep it from computing
# Faults that were mended, by format: the base, what was changed in it ([begin, end, hexadecimal]) and what it did.
CORPUS = Path(__file__).with_name("corpus.json")

_MOST_FINDINGS = 1000
Key = tuple[str, int | str]


@dataclass(frozen=True)
class Format:
    """A kind of file: ``bases`` makes files that are right, ``read`` reads one, ``crafted`` makes hostile ones.

    ``text`` also mutates lines, words and numbers. ``within`` is what may be changed inside, such as what a
    part unpacks to: it returns a mutant made from a way to change bytes, a base and random numbers.
    """

    name: str
    suffix: str
    bases: Callable[[], Sequence[bytes]]
    read: Callable[[Path], object]
    text: bool = False
    crafted: Callable[[], Mapping[str, bytes]] = dict
    within: Callable[[Callable[[bytes], bytes], bytes, random.Random], bytes] | None = None


@dataclass
class Outcome:
    """How many mutants of each format were read or refused, and each fault by the mutant's key."""

    counts: Counter[tuple[str, str]] = field(default_factory=Counter)
    faults: dict[Key, str] = field(default_factory=dict)

    def __str__(self) -> str:
        lines = [f"{name}: {count} {what}" for (name, what), count in sorted(self.counts.items())]
        return "\n".join([*lines, *(f"{key}: {why}" for key, why in self.faults.items())])


# --- mutators ---------------------------------------------------------------------------------------------------------

_EXTREMES = (b"\0", b"\xff", b"\x7f", b"\x80", b"\x01")
_NUMBERS = (
    *(b"nan", b"inf", b"-inf", b"1e308", b"-1e308", b"1e309", b"1e-320", b"0", b"-0", b"-1", b"1", b"2", b"255"),
    *(b"65536", b"2147483648", b"18446744073709551616", b"9" * 400, b"0x10", b"1_000", b"1,5", b"", b" ", b"1.5.2"),
    *("٣".encode(), "²".encode(), b"1e", b"true", b"null", b"~", b".5", b"+1", b"1e400", b"00012"),
)
_DAMAGE = (b"\xff", b"\xc3", b"\xed\xa0\x80", b"\0", b"\xef\xbb\xbf", b"\x85", b"\r", b"\x0c", b"\x1b[2J", b"\x9b")
_SIGNS = tuple(sign.encode() for sign in ("\u202e", "\u2028", "\ufeff", "\U0001f600", "\x85", "\x1c", "\x0b"))
_MARKS = (b'"', b"'", b",", b";", b"\t", b"#", b":", b"- ", b"[", b"]", b"{", b"}", b"&a ", b"*a ", b"!!", b"|", b"%")


def _place(rng: random.Random, data: bytes) -> int:
    return rng.randrange(len(data) + 1) if rng.random() < 0.7 else rng.randrange(min(len(data), 200) + 1)


def _flip(rng: random.Random, data: bytes) -> bytes:
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 4, 16))):
        at = _place(rng, data) - 1
        changed[at] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _truncate(rng: random.Random, data: bytes) -> bytes:
    return data[: _place(rng, data)]


def _splice(rng: random.Random, data: bytes) -> bytes:
    size = min(len(data), rng.choice((1, 4, 8, 16, 64, 400)))
    begin, target = rng.randrange(len(data) - size + 1), _place(rng, data)
    end = target + rng.choice((0, 0, size))
    return data[:target] + data[begin : begin + size] + data[end:]


def _cut_out(rng: random.Random, data: bytes) -> bytes:
    at = _place(rng, data)
    return data[:at] + data[at + rng.choice((1, 2, 4, 8, 50)) :]


def _extreme(rng: random.Random, data: bytes) -> bytes:
    size = rng.choice((1, 2, 4, 4, 8))
    at = _place(rng, data) // size * size
    value = rng.choice(_EXTREMES) * size
    if rng.random() < 0.5:
        value = rng.getrandbits(rng.randrange(1, 8 * size + 1)).to_bytes(size, rng.choice(("little", "big")))
    return data[:at] + value + data[at + size :]


def _repeat(rng: random.Random, data: bytes) -> bytes:
    return data * rng.choice((2, 2, 3, 30))


def _damage(rng: random.Random, data: bytes) -> bytes:
    at = _place(rng, data)
    return data[:at] + rng.choice(_DAMAGE) * rng.choice((1, 1, 3)) + data[at:]


BYTES = (_flip, _flip, _truncate, _splice, _splice, _cut_out, _extreme, _extreme, _extreme, _repeat, _damage)


def _number(rng: random.Random, data: bytes) -> bytes:
    places = [m.span() for m in re.finditer(rb"[-+]?\d[\d.eE+-]*", data)]
    if not places:
        return data
    changed = data
    for begin, end in sorted(rng.sample(places, min(len(places), rng.choice((1, 1, 2, 5)))), reverse=True):
        changed = changed[:begin] + rng.choice(_NUMBERS) + changed[end:]
    return changed


def _word(rng: random.Random, data: bytes) -> bytes:
    places = [m.span() for m in re.finditer(rb"[^\s,;:\[\]{}\"]+", data)]
    if len(places) < 2:
        return data
    (begin, end), (other, after) = sorted(rng.sample(places, 2))
    words = [data[begin:end], data[other:after]]
    if rng.random() < 0.5:
        words.reverse()
    else:
        words[0] = rng.choice((words[1], b"", *_NUMBERS, *_SIGNS, words[0] * 1000))
    return data[:begin] + words[0] + data[end:other] + words[1] + data[after:]


def _line(rng: random.Random, data: bytes) -> bytes:
    lines = data.splitlines(keepends=True)
    if not lines:
        return data
    at, to = rng.randrange(len(lines)), rng.randrange(len(lines))
    what = rng.randrange(5)
    if what == 0:
        del lines[at]
    elif what == 1:
        lines.insert(to, lines[at])
    elif what == 2:
        lines[at], lines[to] = lines[to], lines[at]
    elif what == 3:
        lines[at] = lines[at] * rng.choice((10, 300))
    else:
        lines[at] = lines[at].rstrip(b"\r\n")
    return b"".join(lines)


def _mark(rng: random.Random, data: bytes) -> bytes:
    at = _place(rng, data)
    return data[:at] + rng.choice(_MARKS + _SIGNS) * rng.choice((1, 1, 2)) + data[at:]


def _nest(rng: random.Random, data: bytes) -> bytes:
    at = _place(rng, data)
    return data[:at] + rng.choice((b"[", b"{a: ", b"- ", b'{"a":', b'"', b"(")) * rng.choice((60, 3000)) + data[at:]


def _encode(rng: random.Random, data: bytes) -> bytes:
    text = data.decode("utf-8", "replace")
    return text.encode(rng.choice(("utf-16", "utf-16-be", "utf-32", "utf-8-sig", "cp037", "utf-7")), "replace")


TEXT = (*BYTES, *(_number,) * 8, *(_word,) * 4, *(_line,) * 4, *(_mark,) * 4, _nest, _encode)


def mutant(form: Format, number: int) -> bytes:
    """Return the mutant of a ``number``."""
    rng = random.Random(f"{form.name} {number}")
    ways = TEXT if form.text else BYTES
    data = rng.choice(form.bases())

    def changed(old: bytes) -> bytes:
        for _ in range(rng.choice((1, 1, 1, 2, 3))):
            old = rng.choice(ways)(rng, old or b"\0")
        return old

    if form.within is not None and rng.random() < 0.6:
        return form.within(changed, data, rng)
    return changed(data)


# --- what was met -----------------------------------------------------------------------------------------------------


def difference(base: bytes, data: bytes) -> list[list[int | str]]:
    """Return what was changed from ``base`` to ``data``, as the corpus has it."""
    if len(base) == len(data):
        places = [at for at in range(len(base)) if base[at] != data[at]]
        if len(places) <= 32:
            return [[at, at + 1, data[at : at + 1].hex()] for at in places]
    same = next((at for at, (a, b) in enumerate(zip(base, data, strict=False)) if a != b), min(len(base), len(data)))
    most = min(len(base), len(data)) - same
    after = next((n for n in range(most) if base[-1 - n] != data[-1 - n]), most)
    return [[same, len(base) - after, data[same : len(data) - after].hex()]]


def edited(base: bytes, edits: Sequence[Sequence[Any]]) -> bytes:
    """Return ``base`` with ``edits``, which do not overlap and stand in their order."""
    for begin, end, new in reversed(edits):
        base = base[:begin] + bytes.fromhex(new) + base[end:]
    return base


def corpus(form: Format) -> dict[str, bytes]:
    """Return the mutants of the corpus, by the name ``corpus 0`` and on."""
    met = json.loads(CORPUS.read_text(encoding="utf-8")).get(form.name, [])
    bases = form.bases()
    return {f"corpus {n}": edited(bases[entry["base"]], entry["edits"]) for n, entry in enumerate(met)}


# --- the child --------------------------------------------------------------------------------------------------------


def _bytes_of(form: Format, which: int | str) -> bytes:
    if isinstance(which, int):
        return mutant(form, which)
    return corpus(form)[which] if which.startswith("corpus ") else form.crafted()[which]


def _judged(form: Format, which: int | str, folder: Path) -> tuple[str, str]:
    """Return what became of one mutant, and why where it is a fault."""
    file = folder / f"mutant{form.suffix}"
    file.write_bytes(_bytes_of(form, which))
    began_s = time.process_time()
    what, why = "read", ""
    try:
        form.read(file)
    except InputError as error:
        what = "refused"
        shown = [str(finding) for finding in error.findings]
        if not shown or not all(line and "\n" not in line and not hidden_character(line) for line in shown):
            what, why = "fault", f"its findings are not a line each, without hidden characters: {shown[:3]!r}"
        if len(shown) > _MOST_FINDINGS:
            what, why = "fault", f"it has {len(shown)} findings"
    except BaseException:
        what, why = "fault", traceback.format_exc(limit=-6)
    took_s = time.process_time() - began_s
    return (what, why) if took_s <= MOST_S else ("fault", f"took {took_s:.0f} s of computing. {why}")


def _limit_memory() -> None:
    """Let this process take 1 GB more than it has, where the system can."""
    with contextlib.suppress(ImportError, OSError, ValueError):
        import resource

        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        most = pages * resource.getpagesize() + MOST_BYTES
        resource.setrlimit(resource.RLIMIT_AS, (most, most))


def formats(module: str) -> dict[str, Format]:
    """Return the formats of ``module``, by name."""
    return {form.name: form for form in importlib.import_module(module).FORMATS}


def _child(module: str) -> None:
    """Read the mutants whose keys stand in standard input, and say of each when it begins and what became of it."""
    known = formats(module)
    keys = json.load(sys.stdin)
    said, sys.stdout = sys.stdout, sys.stderr
    with tempfile.TemporaryDirectory() as folder:
        for form in {name: known[name] for name, _ in keys}.values():
            first = Path(folder, f"base{form.suffix}")
            first.write_bytes(form.bases()[0])
            form.read(first)  # what is imported on the way is no mutant's memory
        _limit_memory()
        for name, which in keys:
            print(json.dumps([name, which]), file=said, flush=True)
            print(json.dumps(_judged(known[name], which, Path(folder))), file=said, flush=True)


# --- the parent -------------------------------------------------------------------------------------------------------


def _lines(process: subprocess.Popen[str]) -> Iterator[Any]:
    """Yield what the child says, until it ends or says nothing for too long."""
    said: queue.Queue[str] = queue.Queue()

    def listen() -> None:
        for line in known(process.stdout):
            said.put(line)
        said.put("")

    threading.Thread(target=listen, daemon=True).start()
    with contextlib.suppress(queue.Empty):
        while line := said.get(timeout=PATIENCE_S):
            yield json.loads(line)


def read_all(module: str, keys: Sequence[Key]) -> Outcome:
    """Read the mutants ``keys`` of the formats of ``module`` in child processes, and return what became of them."""
    outcome = Outcome()
    left = list(keys)
    while left:
        command = [sys.executable, "-W", "error", "-m", "tests.stress.mutants", module]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        with (
            tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as errors,
            subprocess.Popen(command, cwd=ROOT, text=True, **{**pipes, "stderr": errors}) as process,  # type: ignore[call-overload]  # the pipes are as subprocess has them
        ):
            known(process.stdin).write(json.dumps(left))
            known(process.stdin).close()
            reading: Key | None = None
            done = 0
            for line in _lines(process):
                if reading is None:
                    reading = (line[0], line[1])
                    continue
                what, why = line
                outcome.counts[reading[0], what] += 1
                if what == "fault":
                    outcome.faults[reading] = why
                done, reading = done + 1, None
            process.kill()
            process.wait()
            errors.seek(0)
            if reading is not None:
                why = f"the process ended with {process.returncode}, or was stopped after {PATIENCE_S:g} s of silence"
                outcome.counts[reading[0], "fault"] += 1
                outcome.faults[reading] = f"{why}: {errors.read()[-2000:]}"
                done += 1
            elif done < len(left):
                raise RuntimeError(f"no mutant was read: {errors.read()[-2000:]}")
        left = left[done:]
    return outcome


def keys_of(module: str, numbers: Mapping[str, range] | range) -> list[Key]:
    """Return the keys of the mutants of ``numbers``, of all that was crafted, and of the corpus, for every format."""
    keys: list[Key] = []
    for form in formats(module).values():
        chosen = numbers if isinstance(numbers, range) else numbers[form.name]
        keys += [(form.name, number) for number in chosen]
        keys += [(form.name, name) for name in (*form.crafted(), *corpus(form))]
    return keys


def main(words: Sequence[str]) -> None:
    """Read mutants as ``words`` ask: module, format, and a number or a range of numbers."""
    if len(words) == 1:
        return _child(words[0])
    module, name, *numbers = words
    form = formats(module)[name]
    if len(numbers) == 2:
        outcome = read_all(module, [(name, number) for number in range(*map(int, numbers))])
        return print(outcome)
    which = int(numbers[0]) if numbers[0].isdigit() else numbers[0]
    data = _bytes_of(form, which)
    close = min(range(len(form.bases())), key=lambda n: len(json.dumps(difference(form.bases()[n], data))))
    print(json.dumps({"base": close, "edits": difference(form.bases()[close], data)})[:2000])
    with tempfile.TemporaryDirectory() as folder:
        print(*_judged(form, which, Path(folder)), sep="\n")


if __name__ == "__main__":
    main(sys.argv[1:])
