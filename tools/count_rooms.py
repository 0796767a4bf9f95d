#!/usr/bin/env python3
"""Count and draw the house: modules, lines, circles, declarations alike, single importers, faces, imports of tests.

    python tools/count_rooms.py [FOLDER OF A CHECKOUT] [--list | --check | --lower]

A module counts as imported by another where one of its names is imported there, directly or through a face. With
``--list``, the modules that exactly one other module imports are named, and those within rooms that tests import.

With ``--check``, as in `make check`, the exit status is 1 where a count is above its budget in ``[tool.rooms]`` of
pyproject.toml: of the whole, of a room, of a face, of the tests, of the pages, of the benchmarks; and where the picture
in CONTRIBUTING.md is not that of the imports. ``--lower`` brings each budget down to its count, and draws the picture
again. A budget is raised by hand, with a decision record that says what for.
"""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from itertools import combinations
from pathlib import Path

COMMAND = "runner.cli.main"
# Pages that tools write whole: by `make api`, `make licences`, `python tools/promises.py`.
GENERATED = ("api.md", "keys.md", "licences.md", "log_records.md", "options.md", "promises.md")
SHARED = 6  # names: two declarations that share so many are one form, written twice
KIND = re.compile(r'": "([a-z_]+(?:\.\w+)+):[A-Za-z]\w*"')  # as a registry names it
DRAWN = "<!-- drawn by python tools/count_rooms.py --lower -->\n", "<!-- drawn -->\n"
PACKAGES = ("documents", "devices", "stimuli", "analysis", "runner", "extensions", "cyclopean")


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


def lines_of(files: Iterable[Path]) -> int:
    """Return how many lines files have together."""
    return sum(file.read_text(encoding="utf-8").count("\n") for file in files)


def once_imported(modules: dict[str, Path], faces: dict[str, dict[str, str]]) -> dict[str, str]:
    """Return the modules that exactly one other module imports, and which; not kinds, which a registry names."""
    importers: dict[str, set[str]] = {name: set() for name in modules}
    for name, file in modules.items():
        for kind in KIND.findall(file.read_text(encoding="utf-8")):
            importers.pop(kind, None)
        for imported in imports_of(file, modules, faces):
            if imported in importers and imported != name:
                importers[imported].add(name)
    leaves = [name for name in importers if modules[name].name != "__init__.py"]
    return {name: next(iter(importers[name])) for name in leaves if len(importers[name]) == 1}


def circles(modules: dict[str, Path], faces: dict[str, dict[str, str]]) -> list[str]:
    """Return the packages and rooms of which parts, rooms or files, import each other by whatever way round."""
    parts: dict[str, dict[str, set[str]]] = {}
    for name, file in modules.items():
        for imported in imports_of(file, modules, faces):
            own, other = name.split("."), imported.split(".")
            depth = next((at for at, pair in enumerate(zip(own, other, strict=False)) if pair[0] != pair[1]), 0)
            if depth and imported in modules:
                parts.setdefault(".".join(own[:depth]), {}).setdefault(own[depth], set()).add(other[depth])
    found = []
    for parent, graph in sorted(parts.items()):
        try:
            TopologicalSorter(graph).prepare()
        except CycleError:
            found.append(parent)
    return found


def declared(tree: ast.Module) -> Iterator[tuple[bool, frozenset[str]]]:
    """Yield, of each declaration with six names or more, whether it is a class, and its fields or parameters."""
    for node in ast.walk(tree):
        names: set[str] = set()
        if isinstance(node, ast.ClassDef):
            own = [part for part in node.body if isinstance(part, ast.AnnAssign)]
            fields = [part.target for part in own if "ClassVar" not in ast.unparse(part.annotation)]
            names = {field.id for field in fields if isinstance(field, ast.Name)}
        elif isinstance(node, ast.FunctionDef):
            given = node.args
            names = {each.arg for each in given.args + given.kwonlyargs + given.posonlyargs} - {"self", "cls"}
        if len(names) >= SHARED:
            yield isinstance(node, ast.ClassDef), frozenset(names)


def forms_of(trees: list[ast.Module]) -> dict[str, int]:
    """Return how many pairs of declarations, and of classes alone, share six names; and how many write JSON by hand."""
    found = [one for tree in trees for one in declared(tree)]
    alike = [a[0] and b[0] for a, b in combinations(found, 2) if len(a[1] & b[1]) >= SHARED]
    functions = (node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))
    written = sum(node.name == "to_json" for node in functions)
    return {"pairs_alike": len(alike), "class_pairs_alike": sum(alike), "to_json_by_hand": written}


def room_of(file: Path, root: Path) -> str:
    """Return the room that a module lies in, such as ``analysis.scaling``; loose ones lie in their package."""
    return ".".join(file.relative_to(root).parts[:-1][:2])


def counts_of(root: Path) -> dict[str, dict[str, int]]:
    """Return all that has a budget: the ``whole``, the lines of each ``room``, the names of each ``face``."""
    modules, faces = modules_of(root), names_through_faces(root)
    leaves = [name for name, file in modules.items() if file.name != "__init__.py"]
    core = {name: file for name, file in modules.items() if not name.startswith("extensions")}
    trees = {name: ast.parse(file.read_text(encoding="utf-8")) for name, file in modules.items()}
    named = {
        name: [one.name for one in ast.walk(tree) if isinstance(one, ast.ClassDef)] for name, tree in trees.items()
    }
    classes = {name: len(own) for name, own in named.items()}
    meanings = Counter(one for own in named.values() for one in own if not one.startswith("_"))
    pages = [file for file in (root / "docs").glob("*.md") if file.name not in GENERATED]
    benchmarks = list((root / "benchmarks").rglob("*.py"))
    whole = {
        "lines": lines_of(modules.values()),
        "modules": len(leaves),
        "classes": sum(classes.values()),
        "class_names_shared": sum(count > 1 for count in meanings.values()),
        "circles": len(circles(modules, faces)),
        **forms_of(list(trees.values())),
        "one_importer_percent": round(100 * len(once_imported(modules, faces)) / len(leaves)),
        "test_lines": lines_of((root / "tests").rglob("*.py")),
        "test_imports_within": imports_in_tests(root, modules, faces)["inner"].total(),
        "doc_words": sum(len(file.read_text(encoding="utf-8").split()) for file in pages),
        "benchmark_lines": lines_of(benchmarks),
        "benchmark_files": len(benchmarks),
    }
    if len(core) < len(modules):
        whole["core_lines"] = lines_of(core.values())
        whole["core_modules"] = sum(name in core for name in leaves)
        whole["core_classes"] = sum(classes[name] for name in core)
    rooms: dict[str, list[Path]] = {}
    for file in modules.values():
        rooms.setdefault(room_of(file, root), []).append(file)
    return {
        "whole": whole,
        "room": {room: lines_of(files) for room, files in sorted(rooms.items())},
        "face": {face: len(names) for face, names in sorted(faces.items()) if face.count(".") == 1},
    }


def arrows(root: Path) -> dict[str, set[str]]:
    """Return each room, and the rooms that it imports from, less those that a longer way of arrows leads to."""
    modules, faces = modules_of(root), names_through_faces(root)
    graph: dict[str, set[str]] = {}
    for file in modules.values():
        if "." in (room := room_of(file, root)):
            inner = (modules[other] for other in imports_of(file, modules, faces) if other in modules)
            graph.setdefault(room, set()).update(room_of(other, root) for other in inner)
    below: dict[str, set[str]] = {}

    def further(room: str) -> set[str]:
        if room not in below:
            below[room] = set().union(*(direct[other] | further(other) for other in direct[room]))
        return below[room]

    direct = {room: {other for other in others if other in graph and other != room} for room, others in graph.items()}
    return {room: others - further(room) for room, others in sorted(direct.items())}


def picture(root: Path) -> Iterator[str]:
    """Yield the lines of a picture in Mermaid: a frame for each package, the highest floor first, and the arrows."""
    graph = arrows(root)
    yield from ("```mermaid", "flowchart TD")
    for package in reversed(PACKAGES):
        yield f"  subgraph {package}"
        yield from (f"    {room}[{room.split('.')[1]}]" for room in graph if room.startswith(f"{package}."))
        yield "  end"
    yield from (f"  {room} --> {' & '.join(sorted(others))}" for room, others in graph.items() if others)
    yield "```"


def drawn(text: str, root: Path) -> str:
    """Return the text of CONTRIBUTING.md with the picture as it is now."""
    before, rest = text.split(DRAWN[0])
    return before + DRAWN[0] + "\n".join(picture(root)) + "\n" + DRAWN[1] + rest.split(DRAWN[1])[1]


def beyond(counts: dict[str, dict[str, int]], budgets: dict[str, dict[str, int]]) -> list[str]:
    """Return a line for each count above its budget, for what has none, and for a budget of what is not there.

    A face has a budget of its own only above ``face_names``, the budget of all.
    """
    most = budgets["whole"]["face_names"]
    said = []
    for part, counted in counts.items():
        known = budgets[part]
        for name, count in counted.items():
            limit = known.get(name, most if part == "face" else None)
            if limit is None:
                said.append(f"{part} {name}: no budget; it counts {count}")
            elif count > limit:
                said.append(f"{part} {name}: {count}, and its budget is {limit}")
        gone = set(known) - set(counted) - {"face_names"}
        said += [f"{part} {name}: has a budget, but is not there" for name in sorted(gone)]
    return said


def lowered(text: str, counts: dict[str, dict[str, int]]) -> str:
    """Return pyproject.toml with each budget brought down to its count, and without those of what is not there."""
    kept, part = [], ""
    for line in text.splitlines(keepends=True):
        if line.startswith("["):
            part = line.strip().removeprefix("[tool.rooms.").removesuffix("]")
        budget = re.fullmatch(r'"?([\w.]+)"? = (\d+)\n', line) if part in counts else None
        if budget and budget[1] != "face_names":
            if (count := counts[part].get(budget[1])) is None:
                continue
            line = line.replace(budget[2], str(min(count, int(budget[2]))))
        kept.append(line)
    return "".join(kept)


def check(root: Path, *, lower: bool) -> None:
    """Compare with the budgets, after lowering them if asked; SystemExit where a count is above its own."""
    project, page = root / "pyproject.toml", root / "CONTRIBUTING.md"
    counts = counts_of(root)
    text = page.read_text(encoding="utf-8")
    if lower:
        project.write_text(lowered(project.read_text(encoding="utf-8"), counts), encoding="utf-8")
        page.write_text(drawn(text, root), encoding="utf-8")
    elif text != drawn(text, root):
        sys.exit("The picture in CONTRIBUTING.md is not that of the imports: type python tools/count_rooms.py --lower")
    said = beyond(counts, tomllib.loads(project.read_text(encoding="utf-8"))["tool"]["rooms"])
    if said:
        sys.exit("Beyond [tool.rooms] in pyproject.toml:\n" + "\n".join(said))


def main() -> None:
    """Print the counts, or compare them with their budgets."""
    words = [word for word in sys.argv[1:] if not word.startswith("--")]
    root = Path(words[0]) if words else Path(__file__).parents[1]
    if {"--check", "--lower"} & set(sys.argv):
        check(root, lower="--lower" in sys.argv)
        return
    modules, faces = modules_of(root), names_through_faces(root)
    leaves = {name: file for name, file in modules.items() if file.name != "__init__.py"}
    once = once_imported(modules, faces)
    reached = {place for names in faces.values() for place in names.values()}
    for name, count in counts_of(root)["whole"].items():
        print(f"{name:26} {count}")
    print(f"{'loose at package roots':26} {sum(name.count('.') == 1 for name in leaves)}")
    print(f"{'with exactly one importer':26} {len(once)}")
    print(f"{'reached through a face':26} {len(reached & set(leaves)) / len(leaves):.0%}")
    print(f"{'names at package faces':26} {sum(len(names) for face, names in faces.items() if '.' not in face)}")
    tests = imports_in_tests(root, modules, faces)
    print(f"{'tests import faces':26} {tests['faces'].total()}")
    if "--list" in sys.argv:
        print(*(f"{name} <- {importer}" for name, importer in once.items()), sep="\n")
        print(*(f"{name} {times} in tests" for name, times in tests["inner"].most_common()), sep="\n")


if __name__ == "__main__":
    main()
