#!/usr/bin/env python3
"""Write docs/promises.md: what is promised, the tests that keep it, and which command runs them.

    python tools/promises.py           write the page
    python tools/promises.py --check   exit with 1 if the page is not what would be written

A test says which promise it keeps: ``@pytest.mark.promise("no-answer-lost")``. A promise without a test, and a test of
a promise that is not made, are errors.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "promises.md"
PROMISES = {
    "measured-mode": "A session refuses a stereo mode that the display was not measured in.",
    "framebuffer": "What reaches the framebuffer is the colour that was asked for, in every mode and for each eye.",
    "clip-cost": "Every trial records, for each eye, how many pixels left the gamut and what that cost in ΔE00.",
    "crosstalk": "Crosstalk is cancelled by a measured matrix, and what could not be cancelled is reported.",
    "no-answer-lost": "An answer is on disk before the next trial appears, and a session resumes where it stopped.",
    "press": "A press never answers a picture that was not yet on the screen.",
    "one-engine": "One engine runs a person, a simulated observer and a replay; known scores come back out.",
    "believable-scores": "Scores come with intervals over observers, consistency, agreement, goodness of fit, classes.",
    "level": "Every default of the analysis holds its level and its coverage, by simulation.",
    "no-needless-work": "Nothing is read, drawn or computed that is not needed, and nothing twice.",
    "check-runs": "Whatever `check` accepts runs, and whatever ran can be reported.",
    "said": "What is nominal, assumed or unknown is said wherever a number depends on it.",
    "one-place": "What was recorded is reported alike by page, Methods, captions, tables and export.",
}
# The command that runs the tests with a marker; those of a folder of that name have it too.
TIERS = {"stress": "make stress", "nightly": "make nightly", "quad": "make test-quad", "vdp": "make test-vdp"}
USUAL = "make test"
OFTEN = (USUAL, "make nightly", "make stress")
_HEAD = """# What is promised, and which tests keep it

Made from the markers of the tests by `python tools/promises.py`. What is promised of run time and error is measured by
the [benchmarks](benchmarks.md).

| promise | test | run by |
|---|---|---|
"""


def marks_of(nodes: list[ast.expr]) -> Iterator[tuple[str, list[str]]]:
    """Yield the markers among expressions such as decorators: name, and the texts in its parentheses."""
    for node in nodes:
        if isinstance(node, ast.List):
            yield from marks_of(node.elts)
            continue
        called = node if isinstance(node, ast.Call) else None
        name = ast.unparse(called.func if called else node)
        if name.startswith("pytest.mark."):
            given = called.args if called else []
            yield name.removeprefix("pytest.mark."), [str(one.value) for one in given if isinstance(one, ast.Constant)]


def kept_promises(root: Path) -> Iterator[tuple[str, str, str]]:
    """Yield the promise, the test that keeps it and the command that runs the test, in the order of files and lines."""
    for file in sorted((root / "tests").rglob("test_*.py")):
        text = file.read_text(encoding="utf-8")
        if "mark.promise(" not in text:
            continue
        name = file.relative_to(root).as_posix()
        body = ast.parse(text).body
        shared = [
            mark
            for node in body
            if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "pytestmark"
            for mark in marks_of([node.value])
        ]
        folder: list[tuple[str, list[str]]] = [(name.split("/")[1], [])]
        for node in body:
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                marks = [*folder, *shared, *marks_of(node.decorator_list)]
                tier = next((TIERS[mark] for mark, _ in marks if mark in TIERS), USUAL)
                for mark, words in marks:
                    if mark == "promise":
                        yield words[0], f"{name}::{node.name}", tier


def page(kept: list[tuple[str, str, str]]) -> str:
    """Return the page; SystemExit for a promise without a test that runs often, or a test of one that is not made."""
    unknown = sorted({promise for promise, _, _ in kept} - set(PROMISES))
    alone = [name for name in PROMISES if not any(promise == name and tier in OFTEN for promise, _, tier in kept)]
    if unknown or alone:
        sys.exit(f"no promise of tools/promises.py: {unknown}; promises without a test that runs often: {alone}")
    rows = []
    for name, sentence in PROMISES.items():
        for number, (_, test, tier) in enumerate(row for row in kept if row[0] == name):
            rows.append(f"| {'' if number else sentence} | `{test}` | `{tier}` |\n")
    return _HEAD + "".join(rows)


def main() -> None:
    """Write the page, or compare it."""
    text = page(list(kept_promises(ROOT)))
    if "--check" not in sys.argv:
        PAGE.write_text(text, encoding="utf-8")
    elif not PAGE.exists() or PAGE.read_text(encoding="utf-8") != text:
        sys.exit("docs/promises.md is not what the tests' markers say: run python tools/promises.py")


if __name__ == "__main__":
    main()
