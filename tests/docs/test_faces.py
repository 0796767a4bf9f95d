"""The faces: every name that a face lists is there, and the names of packages say what they take and give."""

from __future__ import annotations

import ast
import inspect
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("documents", "devices", "stimuli", "analysis", "runner", "cyclopean")
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


@pytest.mark.parametrize("package", PACKAGES)
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


@pytest.mark.parametrize("package", PACKAGES)
def test_importing_a_package_loads_nothing_heavy(package: str) -> None:
    heavy = "('numpy', 'scipy', 'pandas', 'matplotlib', 'moderngl', 'OpenImageIO', 'pydantic', 'colour')"
    code = f"import sys, {package}; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert done.stdout.strip() == "[]"


def test_the_page_of_the_faces_is_up_to_date() -> None:
    command = [sys.executable, str(ROOT / "tools" / "api_page.py"), "--check"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
