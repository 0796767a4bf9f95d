#!/usr/bin/env python3
"""Change one place of the source at random, again and again, and see whether the tests of its room notice.

    python tools/mutants.py --count 200 --seed 1 --json mutants.json
    python tools/mutants.py --files analysis/scaling/separation.py --count 20
    python tools/mutants.py --list --count 20
    python tools/mutants.py --again mutants.json --tree OLDER

A mutant is one comparison, sum, number, condition or truth value that says something else. Each runs against the tests
of its room (`ROOMS`), those of `make test` without windows, in a copy of the checkout, until the first of them fails:
the mutant is killed. One that no test fails on survives; it is printed with its place, and either changes nothing that
can be seen or wants a test. The same seed draws the same mutants of the same source. Those that change nothing are in
tools/equivalent_mutants.toml, with why; they are not run. ``--again`` runs those of a JSON that survived, wherever the
same line stands now; ``--tree`` takes source and tests from another checkout.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from fnmatch import fnmatch
from functools import cache
from itertools import zip_longest
from pathlib import Path
from queue import Queue

ROOT = Path(__file__).parents[1]
MARKS = "not nightly and not stress and not quad and not vdp and not window"
# The files of a room, as patterns, and the folders and files of its tests.
ROOMS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "scaling": (
        ("analysis/scaling/*.py",),
        ("tests/analysis/scaling", "tests/analysis/test_scores_command.py"),
    ),
    "classes": (("analysis/classes/*.py",), ("tests/analysis/classes", "tests/analysis/inference")),
    "comparisons": (("analysis/comparisons/*.py",), ("tests/analysis/comparisons",)),
    "records": (
        ("analysis/records/*.py",),
        (
            "tests/analysis/test_records.py",
            "tests/analysis/comparisons",
            "tests/analysis/observers",
            "tests/analysis/report/test_summary.py",
            "tests/analysis/series",
            "tests/runner/session",
            "tests/runner/test_changed_logs.py",
            "tests/runner/test_damaged_logs.py",
            "tests/runner/test_every_kind.py",
            "tests/runner/test_lost_logs.py",
            "tests/runner/test_recorded_sessions.py",
            "tests/extensions/thresholds/test_records.py",
            "tests/runner/test_valid_logs.py",
        ),
    ),
    "logs": (
        ("documents/files/chain.py", "documents/files/durable_log.py", "documents/files/json_lines.py"),
        ("tests/documents/files", "tests/runner/session", "tests/runner/test_power_cut.py"),
    ),
    "session": (
        ("runner/session/*.py",),
        ("tests/runner/session", "tests/runner/test_session_machine.py", "tests/runner/test_two_writers.py"),
    ),
    "blocks": (
        ("runner/blocks/*.py", "runner/views/*.py"),
        ("tests/runner/blocks", "tests/runner/test_incomplete_pairs.py"),
    ),
    "display": (
        ("devices/display/*.py", "extensions/profiles/converted_table.py"),
        (
            "tests/devices/display",
            "tests/devices/test_display_file.py",
            "tests/devices/readings",
            "tests/extensions/profiles",
        ),
    ),
    "compensation": (("devices/compensation/*.py",), ("tests/devices/compensation",)),
    "presenter": (
        (
            "runner/presenter/arithmetic*.py",
            "runner/presenter/bands.py",
            "runner/presenter/counters.py",
            "runner/presenter/depth.py",
            "runner/presenter/dithering.py",
            "runner/presenter/lettering.py",
            "runner/presenter/pictures.py",
            "runner/scene.py",
            "runner/presenter/view_codes.py",
        ),
        ("tests/runner/presenter",),
    ),
}
# So many files of tests run before the others are collected: most mutants end there.
NEAREST = 4
NOTHING_RAN = 5  # of pytest, where all is deselected
# A change of these ends in an error of numpy at once, or can never be seen.
_WORDS = ("axis", "dtype", "strict")
_SWAPPED: dict[type[ast.AST], tuple[str, str]] = {
    ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="),
    ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Is: ("is", "is not"),
    ast.IsNot: (r"is\s+not", "is"),
    ast.In: ("in", "not in"),
    ast.NotIn: (r"not\s+in", "in"),
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "/"),
    ast.Mod: ("%", "*"),
    ast.Pow: ("**", "*"),
    ast.And: ("and", "or"),
    ast.Or: ("or", "and"),
}


@dataclass(frozen=True, slots=True)
class Mutant:
    """One change of one file: the bytes from ``start`` to ``end`` become ``after``, in line ``line``."""

    file: str
    line: int
    kind: str
    start: int
    end: int
    before: str
    after: str

    def applied(self, source: bytes) -> bytes:
        """Return the file with the change."""
        return source[: self.start] + self.after.encode() + source[self.end :]

    def diff(self, source: bytes) -> str:
        """Return the lines that it changes, before and after."""
        first = source.rfind(b"\n", 0, self.start) + 1
        last = source.find(b"\n", self.end)
        changed = self.applied(source)[first : last + len(self.after.encode()) - (self.end - self.start)]
        old = "".join(f"- {line}\n" for line in source[first:last].decode().split("\n"))
        return old + "".join(f"+ {line}\n" for line in changed.decode().split("\n"))


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a mutant.

    ``killed`` by the first test that failed, ``slow`` past its limit, ``survived``, or ``equivalent`` as the list says.
    """

    mutant: Mutant
    diff: str
    status: str
    by: str
    seconds: float


class _Places:
    """Where the nodes of a source lie, in bytes from its beginning."""

    def __init__(self, source: bytes) -> None:
        self.source = source
        self.starts = [0]
        for line in source.splitlines(keepends=True):
            self.starts.append(self.starts[-1] + len(line))

    def span(self, node: ast.expr) -> tuple[int, int]:
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        start, end = self.starts[node.lineno - 1], self.starts[node.end_lineno - 1]
        return start + node.col_offset, end + node.end_col_offset

    def text(self, node: ast.expr) -> str:
        start, end = self.span(node)
        return self.source[start:end].decode()


def _swap(places: _Places, left: ast.expr, right: ast.expr, operator: ast.AST) -> tuple[int, int, str] | None:
    """Return where the operator between two operands stands, and the other that is put there."""
    if type(operator) not in _SWAPPED:
        return None
    pattern, other = _SWAPPED[type(operator)]
    begin, end = places.span(left)[1], places.span(right)[0]
    known = pattern if "\\" in pattern else re.escape(pattern)
    found = re.search(known, re.sub(r"#.*", lambda said: " " * len(said[0]), places.source[begin:end].decode()))
    return (begin + found.start(), begin + found.end(), other) if found else None


def _number(value: object) -> str | None:
    """Return another number or truth value."""
    if isinstance(value, bool):
        return str(not value)
    if isinstance(value, int):
        return str(value + 1)
    if isinstance(value, float):
        return repr(2.0 * value) if value else "1.0"
    return None


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str))


def _changes(node: ast.AST, places: _Places) -> Iterator[tuple[str, int, int, str]]:
    """Yield the changes of one node: kind, first byte, byte past the last, what stands there instead."""
    if isinstance(node, ast.Compare):
        for left, operator, right in zip([node.left, *node.comparators], node.ops, node.comparators, strict=False):
            if swapped := _swap(places, left, right, operator):
                yield ("comparison", *swapped)
    elif isinstance(node, ast.BinOp) and not (_is_text(node.left) or _is_text(node.right)):
        if swapped := _swap(places, node.left, node.right, node.op):
            yield ("arithmetic", *swapped)
    elif isinstance(node, ast.AugAssign) and not _is_text(node.value):
        if swapped := _swap(places, node.target, node.value, node.op):
            yield ("arithmetic", *swapped)
    elif isinstance(node, ast.BoolOp):
        if swapped := _swap(places, node.values[0], node.values[1], node.op):
            yield ("condition", *swapped)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
        kind = "condition" if isinstance(node.op, ast.Not) else "arithmetic"
        yield (kind, *places.span(node), f"({places.text(node.operand)})")
    elif isinstance(node, ast.If | ast.IfExp | ast.While):
        if not isinstance(node.test, ast.Compare | ast.UnaryOp | ast.NamedExpr):
            yield ("condition", *places.span(node.test), f"(not ({places.text(node.test)}))")
    elif isinstance(node, ast.Constant) and (other := _number(node.value)) is not None:
        yield ("constant", *places.span(node), other)


def _walk(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes that do something: no annotations, decorators, words in `_WORDS`, texts with values in them."""
    yield node
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list") or isinstance(node, ast.JoinedStr):
            continue
        for child in value if isinstance(value, list) else [value]:
            typing_only = isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING"
            word = isinstance(child, ast.keyword) and child.arg in _WORDS
            if isinstance(child, ast.AST) and not typing_only and not word:
                yield from _walk(child)


def mutants_of(file: str, source: bytes) -> list[Mutant]:
    """Return every mutant of a file, in the order of its lines."""
    places, made = _Places(source), []
    for node in _walk(ast.parse(source)):
        for kind, start, end, after in _changes(node, places):
            line = source.count(b"\n", 0, start) + 1
            made.append(Mutant(file, line, kind, start, end, source[start:end].decode(), after))
    return sorted(made, key=lambda mutant: (mutant.start, mutant.end, mutant.after))


def room_of(file: str) -> str:
    """Return the room that a file belongs to."""
    for room, (files, _) in ROOMS.items():
        if any(Path(file).parent == Path(pattern).parent and fnmatch(file, pattern) for pattern in files):
            return room
    sys.exit(f"{file} belongs to no room of tools/mutants.py; add it to ROOMS, with its tests")


def files_of_rooms(root: Path) -> list[str]:
    """Return the files of all rooms, without their faces."""
    found = {file for files, _ in ROOMS.values() for pattern in files for file in root.glob(pattern)}
    return sorted(file.relative_to(root).as_posix() for file in found if file.name != "__init__.py")


def draw(root: Path, files: Iterable[str], count: int, seed: int) -> list[Mutant]:
    """Return ``count`` mutants of the files, of each kind as many, drawn without replacement."""
    kinds: dict[str, list[Mutant]] = {}
    for file in files:
        for mutant in mutants_of(file, (root / file).read_bytes()):
            kinds.setdefault(mutant.kind, []).append(mutant)
    rng = random.Random(seed)
    for known in kinds.values():
        rng.shuffle(known)
    in_turn = zip_longest(*(kinds[kind] for kind in sorted(kinds)))
    return [mutant for turn in in_turn for mutant in turn if mutant is not None][:count]


def again(root: Path, file: Path) -> list[Mutant]:
    """Return the mutants of a JSON that survived: the same change of the same lines, in a file of the same name."""
    known = files_of_rooms(root)
    found = []
    for outcome in json.loads(file.read_text(encoding="utf-8"))["outcomes"]:
        was = Mutant(**outcome["mutant"])
        named = sorted((one for one in known if Path(one).name == Path(was.file).name), key=lambda one: one != was.file)
        here = [mutant for one in named for mutant in mutants_of(one, (root / one).read_bytes())]
        alike = [one for one in here if one.diff((root / one.file).read_bytes()) == outcome["diff"]]
        if outcome["status"] == "survived":
            if not alike:
                print(f"gone: {was.file}:{was.line}\n{outcome['diff']}")
            found += sorted(alike, key=lambda one: (one.file != was.file, abs(one.line - was.line)))[:1]
    return found


@cache
def equivalents() -> frozenset[tuple[str, str]]:
    """Return the mutants that change nothing that can be seen: the name of the module, and the changed lines."""
    listed = tomllib.loads((ROOT / "tools" / "equivalent_mutants.toml").read_text(encoding="utf-8"))
    return frozenset((one["module"], one["diff"]) for one in listed["mutant"])


def tests_of(root: Path, file: str) -> list[str]:
    """Return the test files of a file's room: those of its own name first, then those that say any of its names."""
    costs = dict.fromkeys([""], 0.0)
    listed = root / "tests" / "slow_files.txt"
    if listed.exists():
        lines = (line.split() for line in listed.read_text(encoding="utf-8").splitlines() if line[:1] not in ("#", ""))
        costs |= {name: float(cost) for cost, name in lines}
    _, places = ROOMS[room_of(file)]
    found = {test for place in places for test in ((root / place).rglob("test_*.py"))}
    found |= {root / place for place in places if (root / place).is_file()}
    names = sorted(test.relative_to(root).as_posix() for test in found)
    stem, said = Path(file).stem, _names_of(root / file)

    def rank(name: str) -> tuple[bool, bool, float, str]:
        words = set(re.findall(r"\w+", (root / name).read_text(encoding="utf-8")))
        return stem not in Path(name).stem, not said & words, costs.get(name, 0.0), name

    return sorted(names, key=rank)


def _names_of(file: Path) -> set[str]:
    """Return the name of a module and the public names that it defines."""
    made = [node.name for node in ast.parse(file.read_bytes()).body if isinstance(node, ast.FunctionDef | ast.ClassDef)]
    return {file.stem, *(name for name in made if name[0] != "_")}


def copied(root: Path, to: Path) -> Path:
    """Copy what git tracks or would track, and return where to."""
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    told = subprocess.run(listed, cwd=root, capture_output=True, check=True)
    for name in filter(None, told.stdout.decode().split("\0")):
        if (root / name).is_file():
            (to / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(root / name, to / name)
    return to


def run_tests(tree: Path, tests: Sequence[str], limit_s: float) -> tuple[str, str, float]:
    """Run tests until the first fails; return ``survived``, ``killed`` or ``slow``, by which test, and the seconds."""
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-m", MARKS, *tests]
    environment = {**os.environ, "PYTHONPATH": str(tree), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    began_s = time.monotonic()
    with tempfile.TemporaryFile() as told:
        running = subprocess.Popen(
            command, cwd=tree, env=environment, stdout=told, stderr=subprocess.STDOUT, start_new_session=True
        )
        try:
            status = "survived" if running.wait(limit_s) in (0, NOTHING_RAN) else "killed"
        except subprocess.TimeoutExpired:
            status = "slow"
        finally:
            if running.poll() is None:
                os.killpg(running.pid, signal.SIGKILL)
                running.wait()
        told.seek(0)
        text = told.read().decode("utf-8", "replace")
    failed = re.search(r"^(?:FAILED|ERROR) (\S+)", text, re.MULTILINE)
    by = failed[1] if failed else (text.strip().splitlines() or [""])[-1]
    return status, by if status == "killed" else "", time.monotonic() - began_s


def put(file: Path, source: bytes, now_s: int) -> None:
    """Write a module, with a time of its own: Python knows a compiled file by the second and the size of its source."""
    file.write_bytes(source)
    os.utime(file, (now_s, now_s))


def attempt(tree: Path, mutant: Mutant, limit_s: float, number: int = 1, *, near: bool = False) -> Outcome:
    """Run one mutant in a tree, with the nearest tests alone where asked, and leave the tree as it was."""
    file = tree / mutant.file
    source = file.read_bytes()
    diff = mutant.diff(source)
    if (file.stem, diff) in equivalents():
        return Outcome(mutant, diff, "equivalent", "", 0.0)
    stamp_s = int(time.time()) + 2 * number
    put(file, mutant.applied(source), stamp_s)
    status, by, seconds = "survived", "", 0.0
    try:
        tests = tests_of(tree, mutant.file)
        for some in filter(None, (tests[:NEAREST], tests[NEAREST : NEAREST if near else None])):
            if status == "survived":
                status, by, took_s = run_tests(tree, some, limit_s)
                seconds += took_s
    finally:
        put(file, source, stamp_s + 1)
    return Outcome(mutant, diff, status, by, round(seconds, 1))


def attempts(
    root: Path, drawn: Sequence[Mutant], jobs: int, limit_s: float, *, near: bool = False
) -> Iterator[Outcome]:
    """Yield what became of each mutant, in the order of ``drawn``; each job has a copy of the checkout."""
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder, ThreadPoolExecutor(jobs) as pool:
        trees: Queue[Path] = Queue()
        for job in range(jobs):
            trees.put(copied(root, Path(folder) / str(job)))

        def one(number: int, mutant: Mutant) -> Outcome:
            tree = trees.get()
            try:
                return attempt(tree, mutant, limit_s, number, near=near)
            finally:
                trees.put(tree)

        yield from pool.map(one, range(1, len(drawn) + 1), drawn)


def unchanged(root: Path, drawn: Sequence[Mutant], limit_s: float) -> None:
    """End the program where a room's tests fail though nothing is changed: they would kill every mutant."""
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        tree = copied(root, Path(folder))
        for room, file in {room_of(mutant.file): mutant.file for mutant in drawn}.items():
            status, by, seconds = run_tests(tree, tests_of(tree, file), limit_s)
            if status != "survived":
                sys.exit(f"the tests of {room} fail though nothing is changed: {status} {by}")
            print(f"{room}: its tests pass unchanged, in {seconds:.0f} s", flush=True)


def main() -> None:
    """Draw mutants, run them, print the survivors, and write everything as JSON where asked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=200, help="how many mutants (200)")
    parser.add_argument("--seed", type=int, default=1, help="of the draw (1)")
    parser.add_argument("--skip", type=int, default=0, help="leave out so many of the first that are drawn")
    parser.add_argument("--near", action="store_true", help="run the nearest tests alone: more survive, in less time")
    parser.add_argument("--again", type=Path, metavar="JSON", help="no draw: those of this file that survived")
    parser.add_argument("--tree", type=Path, default=ROOT, help="the checkout (this one)")
    parser.add_argument("--files", nargs="+", help="draw from these files, not from all of the rooms")
    parser.add_argument("--jobs", type=int, default=1, help="how many run at a time (1)")
    parser.add_argument("--limit-s", type=float, default=900.0, help="how long the tests of a mutant may take (900)")
    parser.add_argument("--least", type=float, default=0.0, help="share in percent below which the exit status is 1")
    parser.add_argument("--json", type=Path, help="write every mutant and what became of it")
    parser.add_argument("--list", action="store_true", help="print the mutants, run nothing")
    parser.add_argument("--trust", action="store_true", help="do not first run the tests with nothing changed")
    asked = parser.parse_args()
    tree = asked.tree.resolve()
    drawn = (
        again(tree, asked.again)
        if asked.again
        else draw(tree, asked.files or files_of_rooms(tree), asked.count, asked.seed)
    )
    drawn = drawn[asked.skip :]
    if asked.list:
        for mutant in drawn:
            print(f"{mutant.file}:{mutant.line} {mutant.kind}\n{mutant.diff((tree / mutant.file).read_bytes())}")
        return
    if not asked.trust:
        unchanged(tree, drawn, asked.limit_s)
    outcomes = []
    for outcome in attempts(tree, drawn, asked.jobs, asked.limit_s, near=asked.near):
        outcomes.append(outcome)
        mutant = outcome.mutant
        print(f"{outcome.status:8} {outcome.seconds:6.1f} s  {mutant.file}:{mutant.line}  {outcome.by}", flush=True)
        if outcome.status == "survived":
            print(outcome.diff, flush=True)
        if asked.json:
            written = {"seed": asked.seed, "outcomes": [asdict(one) for one in outcomes]}
            asked.json.write_text(json.dumps(written, indent=1) + "\n", encoding="utf-8")
    counts = Counter(outcome.status for outcome in outcomes)
    changed = len(outcomes) - counts["equivalent"]
    noticed = changed - counts["survived"]
    print(f"{noticed} of {changed} noticed ({noticed / max(changed, 1):.0%}); {dict(counts)}")
    if 100 * noticed < asked.least * changed:
        sys.exit(f"fewer than {asked.least:g} % were noticed")


if __name__ == "__main__":
    main()
