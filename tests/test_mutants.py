"""What the drawing of mutants changes, and that tests of a tree kill or keep them."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tools import mutants
from tools.mutants import attempt, copied, draw, files_of_rooms, mutants_of, put, room_of

ROOT = Path(__file__).parents[1]
SOURCE = '''\
"""A module with 3 numbers in its words."""
from typing import Literal

MOST: int = 3


def over(value: float, *, strict: Literal[1] = 1) -> bool:
    """Return whether 1 < value."""
    return value > MOST and not value == 7  # + and - say nothing


def twice(a: float, b: float) -> str:
    return f"{a + 1}" + str(a + (b))  # é
'''


def changed(source: str) -> dict[str, str]:
    """Return each changed line by what is said of the change."""
    text = source.encode()
    return {
        f"{one.line}: {one.before} -> {one.after}": one.applied(text).decode().splitlines()[one.line - 1]
        for one in mutants_of("x.py", text)
    }


def test_changes_lie_where_something_is_computed() -> None:
    assert changed(SOURCE) == {
        "4: 3 -> 4": "MOST: int = 4",
        "7: 1 -> 2": "def over(value: float, *, strict: Literal[1] = 2) -> bool:",
        "9: > -> >=": "    return value >= MOST and not value == 7  # + and - say nothing",
        "9: and -> or": "    return value > MOST or not value == 7  # + and - say nothing",
        "9: not value == 7 -> (value == 7)": "    return value > MOST and (value == 7)  # + and - say nothing",
        "9: == -> !=": "    return value > MOST and not value != 7  # + and - say nothing",
        "9: 7 -> 8": "    return value > MOST and not value == 8  # + and - say nothing",
        "13: + -> -": '    return f"{a + 1}" + str(a - (b))  # é',
    }


@pytest.mark.parametrize(
    ("source", "after"),
    [
        ("a is not b", ["a is b"]),
        ("a not in b", ["a in b"]),
        ("(a\n # +\n) * (b)", ["(a\n # +\n) / (b)"]),
        ("a += b", ["a -= b"]),
        ("a //= b", ["a /= b"]),
        ("a ** b", ["a * b"]),
        ("-a", ["(a)"]),
        ("a if b else c", ["a if (not (b)) else c"]),
        ("é = a.sum(axis=0) < b", ["é = a.sum(axis=0) <= b"]),
        ("x = True", ["x = False"]),
        ("x = 0.5", ["x = 1.0"]),
        ("if TYPE_CHECKING:\n    x = 1", []),
    ],
)
def test_each_kind_of_change(source: str, after: list[str]) -> None:
    text = source.encode()
    made = [mutant.applied(text).decode() for mutant in mutants_of("x.py", text)]
    assert made == after
    for one in made:
        compile(one, "x.py", "exec")


def test_the_same_seed_draws_the_same_of_each_kind_as_many() -> None:
    files = ["analysis/classes/multiplicity.py", "devices/display/plvc.py"]
    drawn = draw(ROOT, files, 40, seed=3)
    assert drawn == draw(ROOT, files, 40, seed=3)
    assert drawn != draw(ROOT, files, 40, seed=4)
    assert len(set(drawn)) == 40
    assert {mutant.kind for mutant in drawn[:4]} == {"arithmetic", "comparison", "condition", "constant"}


def test_every_room_has_files_and_tests() -> None:
    files = files_of_rooms(ROOT)
    assert {room_of(file) for file in files} == set(mutants.ROOMS)
    for _, tests in mutants.ROOMS.values():
        assert all((ROOT / test).exists() for test in tests)
    first = mutants.tests_of(ROOT, "analysis/scaling/separation.py")
    assert Path(first[0]).name == "test_separation.py"


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A checkout of one module and its tests, which do not look at how many there are at most."""
    made = tmp_path / "checkout"
    made.mkdir()
    (made / "sums.py").write_text("MOST = 3\n\n\ndef add(a, b):\n    return a + b\n")
    (made / "test_sums.py").write_text("import sums\n\n\ndef test_add():\n    assert sums.add(2, 2) == 4\n")
    monkeypatch.setattr(mutants, "ROOMS", {"sums": (("sums.py",), ("test_sums.py",))})
    return made


@pytest.mark.nightly
def test_a_sum_that_becomes_a_difference_is_killed_and_what_no_test_sees_survives(tree: Path) -> None:
    source = (tree / "sums.py").read_bytes()
    unseen, seen = mutants_of("sums.py", source)
    survived, killed = attempt(tree, unseen, 60.0, 1), attempt(tree, seen, 60.0, 2)
    assert (survived.status, survived.by) == ("survived", "")
    assert (killed.status, killed.by) == ("killed", "test_sums.py::test_add")
    assert unseen.diff(source) == "- MOST = 3\n+ MOST = 4\n"
    assert (tree / "sums.py").read_bytes() == source
    assert mutants.run_tests(tree, ["test_sums.py"], 60.0)[0] == "survived"  # nothing compiled from a mutant is left


@pytest.mark.nightly
def test_what_never_ends_is_ended(tree: Path) -> None:
    put(tree / "sums.py", b"while True:\n    pass\n", 1_000_000_000)
    status, _, seconds = mutants.run_tests(tree, ["test_sums.py"], 1.5)
    assert status == "slow"
    assert seconds < 30.0


def test_a_copy_holds_what_git_would_keep(tree: Path, tmp_path: Path) -> None:
    subprocess.run(["git", "init", "-q", str(tree)], check=True)
    (tree / ".gitignore").write_text("*.log\n")
    (tree / "kept.log").touch()
    copy = copied(tree, tmp_path / "copy")
    assert sorted(path.name for path in copy.iterdir()) == [".gitignore", "sums.py", "test_sums.py"]
    (copy / "sums.py").write_text("")
    assert (tree / "sums.py").read_text()
