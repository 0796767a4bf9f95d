"""How a check is set out on a terminal."""

from __future__ import annotations

from typing import Any

from click.testing import CliRunner

from runner.cli.check import _lines
from runner.cli.main import group

Study = Any  # tests/conftest.py


def _check(study: Study, *more: str) -> Any:
    words = ["check", str(study.experiment), "--no-screen", "--results", str(study.results), *more]
    return CliRunner().invoke(group, words)


def test_columns_stand_in_line(study: Study) -> None:
    told = _check(study)
    assert told.exit_code == 0
    lines = told.stdout.splitlines()
    head = next(line for line in lines if line.startswith("  block "))
    (pairs,) = [line for line in lines if "all_pairs" in line]
    assert pairs.index("6") == head.index("trials") + len("trials") - 1
    assert pairs[head.index("keys") :].startswith("up or")
    shares = next(line for line in lines if "outside the gamut" in line and "% left" in line)
    (one,) = [line for line in lines if line.startswith("  one ")]
    assert one[: shares.index("% left") + len("% left")].split()[-1].replace(".", "").isdigit()
    assert all(len(line) <= 110 for line in lines if not line.startswith("warning:"))


def test_warnings_alone_leave_the_status_at_0_and_errors_make_it_2(study: Study) -> None:
    told = _check(study)
    assert "right, 2 warnings" in told.stdout
    assert told.exit_code == 0
    study.edit("small.yaml", "question:", "qestion:")
    told = _check(study)
    assert told.exit_code == 2
    assert "error: " in told.stderr
    assert "did you mean 'question'?" in told.stderr


def test_one_is_counted_as_one() -> None:
    facts = {"trials": 1, "minutes": 1.0, "blocks": []}
    assert "session               1 trial, about 1 minute" in list(_lines(facts))
    assert "session               2 trials, about 0.1 minutes" in list(_lines({**facts, "trials": 2, "minutes": 0.1}))
