"""`noxfile.py` and the Makefile are two doors to the same work."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def of_make(target: str) -> list[str]:
    """Return the commands of a target that run a program of the environment, without its folder."""
    lines = (ROOT / "Makefile").read_text(encoding="utf-8").split(f"\n{target}:", 1)[1].split("\n\n", 1)[0].splitlines()
    commands = [
        line.strip()
        .removeprefix("@")
        .removeprefix("$(ONE_THREAD) ")
        .removeprefix("NO_MKDOCS_2_WARNING=1 ")
        .removeprefix("STRESS_WHOLE=$(WHOLE) ")
        .removeprefix("EAGER_IMPORT=1 ")
        .removeprefix("$(BIN)/")
        .removesuffix(" > /dev/null")
        for line in lines[1:]
    ]
    return [command.replace('"', "'") for command in commands]


def of_nox(target: str) -> list[str]:
    """Return the commands of a session."""
    tree = ast.parse((ROOT / "noxfile.py").read_text(encoding="utf-8"))
    session = next(node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == target)
    calls = [node for node in ast.walk(session) if isinstance(node, ast.Call)]
    runs = [call for call in calls if isinstance(call.func, ast.Attribute) and call.func.attr == "run"]
    words = [[str(word.value) for word in call.args if isinstance(word, ast.Constant)] for call in runs]
    return [" ".join(f"'{word}'" if " " in word else word for word in command) for command in words]


def test_check_is_the_same() -> None:
    assert of_nox("check") == of_make("check")


@pytest.mark.parametrize("target", ["test", "nightly", "stress", "demo", "docs"])
def test_the_other_targets_begin_alike(target: str) -> None:
    """The Makefile starts the installed command, and gives the tests their number of workers by a variable."""
    made = of_make(target)[0].replace("cyclopean demo", "python -m cyclopean demo")
    assert made.startswith(of_nox(target)[0])
