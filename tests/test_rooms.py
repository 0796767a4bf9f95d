"""The budgets of rooms, tests and pages: what grows is refused, what shrinks lowers its budget."""

from __future__ import annotations

from pathlib import Path

import pytest

from tools.count_rooms import DRAWN, arrows, beyond, check, counts_of, drawn

PROJECT = """\
[tool.rooms.whole]
lines = 4
modules = 1
classes = 1
class_names_shared = 0
circles = 0
pairs_alike = 0
class_pairs_alike = 0
to_json_by_hand = 0
one_importer_percent = 0
test_lines = 2
test_imports_within = 1
doc_words = 3
benchmark_lines = 2
benchmark_files = 1
face_names = 1

# Lines.
[tool.rooms.room]
"devices" = 0
"devices.lamp" = 4

# Names of larger faces.
[tool.rooms.face]

[tool.other]
kept = true
"""


@pytest.fixture
def house(tmp_path: Path) -> Path:
    """A checkout with one room of three lines."""
    files = {
        "pyproject.toml": PROJECT,
        "devices/__init__.py": "",
        "devices/lamp/__init__.py": "",
        "devices/lamp/__init__.pyi": "from .bulb import Bulb as Bulb\n",
        "devices/lamp/bulb.py": "class Bulb:\n    pass\n\n",
        "tests/test_lamp.py": "from devices.lamp.bulb import Bulb\n",
        "benchmarks/lamp.py": "import time\n\n",
        "docs/lamp.md": "Three short words\n",
        "CONTRIBUTING.md": "".join(("The house:\n", *DRAWN, "Its ways.\n")),
        "docs/api.md": "made from the docstrings, which is counted with the lines\n",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    page = tmp_path / "CONTRIBUTING.md"
    page.write_text(drawn(page.read_text(encoding="utf-8"), tmp_path), encoding="utf-8")
    return tmp_path


def test_what_is_within_its_budgets_passes_and_is_counted(house: Path) -> None:
    check(house, lower=False)
    counts = counts_of(house)
    assert counts["room"] == {"devices": 0, "devices.lamp": 3}
    assert counts["face"] == {"devices.lamp": 1}
    assert counts["whole"] == {
        **dict.fromkeys(["circles", "class_names_shared", "class_pairs_alike", "pairs_alike", "to_json_by_hand"], 0),
        **dict.fromkeys(["modules", "classes", "test_lines", "test_imports_within", "benchmark_files"], 1),
        "one_importer_percent": 0,
        **{"lines": 3, "doc_words": 3, "benchmark_lines": 2},
    }


@pytest.mark.parametrize(
    ("file", "text", "said"),
    [
        ("devices/lamp/bulb.py", "class Bulb:\n    pass\n\n\n\n", {"whole lines", "room devices.lamp"}),
        ("devices/lamp/glow.py", "", {"whole modules"}),
        ("devices/lamp/bulb.py", "class Bulb: ...\nclass Bulb: ...\n", {"whole classes", "whole class_names_shared"}),
        ("devices/fan/__init__.py", "", {"room devices.fan"}),
        ("devices/lamp/__init__.pyi", "from .bulb import A as A\nfrom .bulb import B as B\n", {"face devices.lamp"}),
        ("tests/test_more.py", "\n\n", {"whole test_lines"}),
        (
            "tests/test_lamp.py",
            "import devices.lamp.bulb\nfrom devices.lamp.bulb import Bulb\n",
            {"whole test_imports_within"},
        ),
        ("docs/fan.md", "a word", {"whole doc_words"}),
    ],
)
def test_what_grows_is_named(house: Path, file: str, text: str, said: set[str]) -> None:
    (house / file).parent.mkdir(exist_ok=True)
    (house / file).write_text(text, encoding="utf-8")
    with pytest.raises(SystemExit) as left:
        check(house, lower=True)
    _, *lines = str(left.value).splitlines()
    assert {line.split(":")[0] for line in lines} == said


def test_lowering_takes_the_counts_and_never_raises(house: Path) -> None:
    check(house, lower=True)
    project = (house / "pyproject.toml").read_text(encoding="utf-8")
    assert project == PROJECT.replace("lines = 4", "lines = 3").replace('lamp" = 4', 'lamp" = 3').replace(
        "test_lines = 2", "test_lines = 1"
    )


def test_a_budget_of_what_is_gone_is_refused_and_lowering_takes_it_out(house: Path) -> None:
    budgets = {"whole": {"face_names": 1}, "room": {"devices.fan": 3}, "face": {}}
    assert beyond({"whole": {}, "room": {}, "face": {}}, budgets) == [
        "room devices.fan: has a budget, but is not there"
    ]
    file = house / "pyproject.toml"
    file.write_text(PROJECT.replace('"devices" = 0', '"devices" = 0\n"devices.fan" = 3'), encoding="utf-8")
    with pytest.raises(SystemExit):
        check(house, lower=False)
    check(house, lower=True)
    assert "fan" not in file.read_text(encoding="utf-8")


def test_the_picture_has_no_arrow_that_others_imply_and_is_held_to_the_imports(house: Path) -> None:
    page = house / "CONTRIBUTING.md"
    before = page.read_text(encoding="utf-8")
    assert "    devices.lamp[lamp]\n" in before
    assert " --> " not in before
    for room, imports in (("runner.wall", "devices.lamp"), ("runner.roof", "devices.lamp runner.wall")):
        folder = house.joinpath(*room.split("."))
        folder.mkdir(parents=True)
        (folder / "__init__.py").write_text("".join(f"import {one}\n" for one in imports.split()), encoding="utf-8")
    assert arrows(house) == {"devices.lamp": set(), "runner.wall": {"devices.lamp"}, "runner.roof": {"runner.wall"}}
    with pytest.raises(SystemExit, match="picture"):
        check(house, lower=False)
    with pytest.raises(SystemExit):  # the new rooms have no budgets
        check(house, lower=True)
    after = page.read_text(encoding="utf-8")
    assert "  runner.roof --> runner.wall\n" in after
    assert (after[:10], after[-10:]) == ("The house:", "Its ways.\n")
