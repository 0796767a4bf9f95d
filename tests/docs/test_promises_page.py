"""Which test keeps which promise is read off the tests' markers, and every promise has one that runs often."""

from __future__ import annotations

from pathlib import Path

import pytest

from tools.promises import PAGE, PROMISES, ROOT, kept_promises, page

TESTS = """\
import pytest

pytestmark = [pytest.mark.window, pytest.mark.promise("press")]


@pytest.mark.parametrize("kind", [1])
@pytest.mark.promise("said")
def test_one(kind):
    pass


@pytest.mark.stress
def test_two():
    pass
"""


def test_the_page_is_up_to_date() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(list(kept_promises(ROOT))), "run python tools/promises.py"


def test_markers_of_decorators_modules_and_folders_are_read(tmp_path: Path) -> None:
    for folder in ("runner", "vdp"):
        (tmp_path / "tests" / folder).mkdir(parents=True)
        (tmp_path / "tests" / folder / "test_some.py").write_text(TESTS)
    assert list(kept_promises(tmp_path))[:3] == [
        ("press", "tests/runner/test_some.py::test_one", "make test"),
        ("said", "tests/runner/test_some.py::test_one", "make test"),
        ("press", "tests/runner/test_some.py::test_two", "make stress"),
    ]
    assert {tier for _, test, tier in kept_promises(tmp_path) if "/vdp/" in test} == {"make test-vdp"}


def test_a_promise_needs_a_test_that_runs_often_and_a_test_a_promise() -> None:
    kept = [(name, "tests/test_x.py::test_x", "make test") for name in PROMISES]
    assert page(kept).count("\n| ") == len(PROMISES) + 1
    for wrong in (
        kept[1:],
        [(kept[0][0], kept[0][1], "make test-vdp"), *kept[1:]],
        [*kept, ("none", "x", "make test")],
    ):
        with pytest.raises(SystemExit):
            page(wrong)
