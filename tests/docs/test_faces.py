"""The faces: every name that a face lists is there, and the names of packages say what they take and give."""

from __future__ import annotations

import ast
import inspect
import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from tools.count_rooms import circles, forms_of, imports_in_tests, imports_within, modules_of, names_through_faces

ROOT = Path(__file__).parents[2]
PACKAGES = ("documents", "devices", "stimuli", "analysis", "runner", "extensions", "cyclopean")
FACES = sorted(
    ".".join(stub.parent.relative_to(ROOT).parts)
    for package in PACKAGES
    for stub in (ROOT / package).rglob("__init__.pyi")
)


def _listed(face: str) -> list[str]:
    """Return the names in a face's stub."""
    stub = ROOT.joinpath(*face.split("."), "__init__.pyi")
    nodes = [node for node in ast.parse(stub.read_text(encoding="utf-8")).body if isinstance(node, ast.ImportFrom)]
    return [alias.asname or alias.name for node in nodes for alias in node.names]


@pytest.mark.parametrize("face", FACES)
def test_every_listed_name_is_there(face: str) -> None:
    module = import_module(face)
    names = _listed(face)
    assert len(names) == len(set(names))
    for name in names:
        value = getattr(module, name)
        assert not inspect.ismodule(value), f"{face}.{name} is hidden by a module of that name"
    assert set(names) <= set(dir(module))


@pytest.mark.parametrize("package", [name for name in PACKAGES if name != "extensions"])
def test_a_package_offers_ten_to_two_dozen_described_names(package: str) -> None:
    names = _listed(package)
    assert 10 <= len(names) <= 24
    assert (import_module(package).__doc__ or "").strip()
    for name in names:
        value = getattr(import_module(package), name)
        text = inspect.getdoc(value) or ""
        assert text, f"{package}.{name} has no docstring"
        if inspect.isfunction(value) and inspect.signature(value).parameters:
            assert "Parameters\n---" in text, f"{package}.{name} does not describe its parameters"
            if inspect.signature(value).return_annotation not in (None, "None"):
                said = any(f"{word}\n---" in text for word in ("Returns", "Yields"))
                assert said, f"{package}.{name} does not say what it returns"


def test_importing_the_packages_loads_nothing_heavy() -> None:
    heavy = "('numpy', 'scipy', 'pandas', 'matplotlib', 'moderngl', 'OpenImageIO', 'pydantic', 'colour')"
    code = f"import sys, {', '.join(PACKAGES)}; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert done.stdout.strip() == "[]"


def own_faces(root: Path) -> list[str]:
    """Return where a file takes a name from the face of a room that it lies in: eagerly imported, that is a circle."""
    faces, modules = names_through_faces(root), modules_of(root)
    return [
        f"{name}: take {alias.name} from {faces[node.module][alias.name]}"
        for name, file in modules.items()
        for node in imports_within(file)
        if isinstance(node, ast.ImportFrom) and node.module and name.startswith(f"{node.module}.")
        for alias in node.names
        if alias.name in faces.get(node.module, ())
    ]


@pytest.mark.nightly
def test_no_file_takes_from_the_face_of_its_own_room() -> None:
    assert not own_faces(ROOT)


def test_what_a_file_takes_from_its_own_room_s_face_is_named(tmp_path: Path) -> None:
    room = tmp_path / "devices" / "colour"
    room.mkdir(parents=True)
    (room / "__init__.pyi").write_text("from .spaces import lab as lab\n")
    (room / "__init__.py").touch()
    (room / "spaces.py").touch()
    (room / "plain.py").write_text("def f():\n    from devices.colour import lab, spaces\n")
    assert own_faces(tmp_path) == ["devices.colour.plain: take lab from devices.colour.spaces"]


@pytest.mark.nightly
@pytest.mark.parametrize("words", [["--help"], ["scores", "pairs.csv"], ["doctor"]])
def test_a_command_runs_where_every_face_is_imported_eagerly(words: list[str], tmp_path: Path) -> None:
    """Whichever import comes first: no face needs one that needs it."""
    (tmp_path / "pairs.csv").write_text("winner,loser\n" + "a,b\nb,c\nc,a\na,b\n" * 3)
    code = "import sys; from runner.cli.main import main; sys.argv[0] = 'cyclopean'; main()"
    environment = {**os.environ, "EAGER_IMPORT": "1", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True, cwd=tmp_path, env=environment
    )
    assert "Traceback" not in done.stderr, done.stderr
    assert done.stdout


def test_an_import_counts_once_for_each_module_that_it_names(tmp_path: Path) -> None:
    room = tmp_path / "devices" / "colour"
    for folder in (room, room.parent, tmp_path / "runner" / "cli", tmp_path / "tests"):
        folder.mkdir(parents=True, exist_ok=True)
    for file in ("devices/errors.py", "devices/colour/__init__.py", "devices/colour/spaces.py", "runner/cli/main.py"):
        (tmp_path / file).touch()
    (room / "__init__.pyi").write_text("from .spaces import lab as lab\n")
    lines = [
        "import numpy",
        "from devices.colour import lab, spaces",  # the face, and a module within
        "from devices.colour.spaces import lab, xyz",
        "import devices.colour.spaces",
        "from devices.errors import DeviceError",  # beside the rooms: open to all
        "from runner.cli.main import main",
    ]
    (tmp_path / "tests" / "test_lab.py").write_text("\n".join(lines))
    counts = imports_in_tests(tmp_path, modules_of(tmp_path), names_through_faces(tmp_path))
    assert counts == {"faces": {"devices.colour": 1, "runner.cli.main": 1}, "inner": {"devices.colour.spaces": 3}}


def test_circles_and_forms_alike_are_counted(tmp_path: Path) -> None:
    room = tmp_path / "devices" / "colour"
    room.mkdir(parents=True)
    fields = "".join(f"    {name}: int\n" for name in "abcdef")
    files = {
        "light": f"from devices.colour.eye import see\n\nclass Light:\n{fields}",
        "eye": f"def see(a, b, c, d, e, f):\n    from devices.colour.light import Light\n\nclass Eye:\n{fields}",
        "screen": "def to_json(a, b, c, d, e):\n    ...\n",
    }
    for name, text in files.items():
        (room / f"{name}.py").write_text(text)
    modules = modules_of(tmp_path)
    assert circles(modules, names_through_faces(tmp_path)) == ["devices.colour"]
    trees = [ast.parse(text) for text in files.values()]
    assert forms_of(trees) == {"pairs_alike": 3, "class_pairs_alike": 1, "to_json_by_hand": 1}
    assert not circles({name: file for name, file in modules.items() if "eye" not in name}, {})
