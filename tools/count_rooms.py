#!/usr/bin/env python3
"""Count the house: modules, lines, loose files, modules with one importer, names that faces offer, tests' imports.

    python tools/count_rooms.py [FOLDER OF A CHECKOUT] [--list]

A module counts as imported by another where one of its names is imported there, directly or through a face. With
``--list``, the modules that exactly one other module imports are named, and those within rooms that tests import.
"""

from __future__ import annotations

import ast
import sys
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

COMMAND = "runner.cli.main"
PACKAGES = ("documents", "devices", "stimuli", "analysis", "runner", "cyclopean")


def modules_of(root: Path) -> dict[str, Path]:
    """Return each module's name and file; a package has its own name."""
    modules = {}
    for package in PACKAGES:
        for file in sorted((root / package).rglob("*.py")):
            name = ".".join(file.relative_to(root).with_suffix("").parts).removesuffix(".__init__")
            modules[name] = file
    return modules


def names_through_faces(root: Path) -> dict[str, dict[str, str]]:
    """Return, for each package with a lazy face, the module that each public name comes from."""
    faces: dict[str, dict[str, str]] = {}
    for package in PACKAGES:
        for stub in sorted((root / package).rglob("__init__.pyi")):
            here = ".".join(stub.parent.relative_to(root).parts)
            for node in ast.parse(stub.read_text(encoding="utf-8")).body:
                if isinstance(node, ast.ImportFrom) and node.level == 1 and node.module:
                    for alias in node.names:
                        faces.setdefault(here, {})[alias.asname or alias.name] = f"{here}.{node.module}"
    return faces


@cache
def imports_within(file: Path) -> list[ast.Import | ast.ImportFrom]:
    """Return the imports of ``file``, those within functions too: no expression is looked into, which takes longer."""
    found: list[ast.Import | ast.ImportFrom] = []
    blocks: list[ast.AST] = [ast.parse(file.read_text(encoding="utf-8"))]
    while blocks:
        node = blocks.pop()
        if isinstance(node, ast.Import | ast.ImportFrom):
            found.append(node)
        for part in ("body", "orelse", "handlers", "finalbody", "cases"):
            blocks += getattr(node, part, [])
    return found


def imports_of(file: Path, modules: dict[str, Path], faces: dict[str, dict[str, str]]) -> Iterator[str]:
    """Yield the modules that ``file`` takes names from."""
    for node in imports_within(file):
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                place = inner if inner in modules else faces.get(node.module, {}).get(alias.name, node.module)
                while place in faces and alias.name in faces[place]:
                    place = faces[place][alias.name]
                yield place
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def named_modules(node: ast.AST, modules: dict[str, Path]) -> set[str]:
    """Return the modules that an import names, a face by its own name, whatever its names come from."""
    if isinstance(node, ast.Import):
        return {alias.name for alias in node.names} & set(modules)
    if isinstance(node, ast.ImportFrom) and node.module and not node.level:
        inner = {alias.name: f"{node.module}.{alias.name}" for alias in node.names}
        return {place if place in modules else node.module for place in inner.values()} & set(modules)
    return set()


def imports_in_tests(root: Path, modules: dict[str, Path], faces: dict[str, dict[str, str]]) -> dict[str, Counter[str]]:
    """Return how often tests import each module: ``faces``, with the command; ``inner`` modules, which lie in a room.

    An import counts once for each module that it names. What lies beside the rooms, such as `devices.errors`, is open.
    """
    counts = {"faces": Counter[str](), "inner": Counter[str]()}
    for file in sorted((root / "tests").rglob("*.py")):
        for node in imports_within(file):
            for name in named_modules(node, modules):
                if name in faces or name == COMMAND:
                    counts["faces"][name] += 1
                elif name.count(".") > 1:
                    counts["inner"][name] += 1
    return counts


def main() -> None:
    """Print the counts."""
    words = [word for word in sys.argv[1:] if word != "--list"]
    root = Path(words[0]) if words else Path(__file__).parents[1]
    modules, faces = modules_of(root), names_through_faces(root)
    importers: dict[str, set[str]] = {name: set() for name in modules}
    for name, file in modules.items():
        for imported in imports_of(file, modules, faces):
            if imported in importers and imported != name:
                importers[imported].add(name)
    leaves = {name: file for name, file in modules.items() if file.name != "__init__.py"}
    once = [name for name in leaves if len(importers[name]) == 1]
    lines = sum(file.read_text(encoding="utf-8").count("\n") for file in modules.values())
    reached = {place for names in faces.values() for place in names.values()}
    print(f"modules                    {len(leaves)}")
    print(f"lines                      {lines}")
    print(f"loose at package roots     {sum(name.count('.') == 1 for name in leaves)}")
    print(f"with exactly one importer  {len(once)} ({len(once) / len(leaves):.0%})")
    print(f"reached through a face     {len(reached & set(leaves))} ({len(reached & set(leaves)) / len(leaves):.0%})")
    print(f"names at package faces     {sum(len(names) for face, names in faces.items() if '.' not in face)}")
    tests = imports_in_tests(root, modules, faces)
    print(f"tests' imports of faces    {tests['faces'].total()}")
    print(f"tests' imports within      {tests['inner'].total()}")
    if "--list" in sys.argv:
        print(*(f"{name} <- {next(iter(importers[name]))}" for name in once), sep="\n")
        print(*(f"{name} {times} in tests" for name, times in tests["inner"].most_common()), sep="\n")


if __name__ == "__main__":
    main()
