"""docs/stability.md lists every routine of the registry with its range, limit and unit; its figures are measured."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal

import numpy as np
import pytest

from tests.stress.stability import sixty_digits as s
from tests.stress.stability.page import PAGE, line, measured, read_rows, up
from tests.stress.stability.registry import routines
from tests.stress.stability.routine import ULP


def test_the_page_lists_every_routine_as_the_registry_has_it() -> None:
    rows = read_rows(PAGE.read_text(encoding="utf-8"))
    assert len(rows) >= 40
    assert list(rows) == [routine.name for routine in routines()]
    for routine in routines():
        row = rows[routine.name]
        assert (row.range, row.limit, row.unit, row.outside) == (
            routine.range,
            routine.limit,
            routine.unit,
            routine.outside,
        )
        assert 0.0 <= row.error <= row.limit
        assert row.condition > 0.0


@pytest.mark.parametrize("name", ["colour.delta_e_2000", "DisplayModel.code", "laws.Logistic.probabilities"])
def test_a_figure_of_the_page_is_what_is_measured(name: str) -> None:
    (routine,) = [routine for routine in routines() if routine.name == name]
    row, stated = measured(routine), read_rows(PAGE.read_text(encoding="utf-8"))[name]
    assert stated.error / 4.0 <= row.error <= 4.0 * stated.error
    assert stated.condition / 2.0 <= row.condition <= 2.0 * stated.condition


def test_an_error_that_is_planted_is_measured() -> None:
    (routine,) = [routine for routine in routines() if routine.name == "ToneCurve.linear"]
    off = replace(routine, of=lambda x: routine.of(x) * (1.0 + 1e-9))
    assert routine.error() < 8.0
    assert off.unit == ULP
    assert 1e6 < off.error() < 1e8
    few = replace(routine, inputs=np.array([[0.5]]), exactly=lambda x: [x[0] ** 3], of=lambda x: x**3)
    assert few.error() < 1.0
    assert few.condition() == pytest.approx(3.0, rel=1e-12)


def test_figures_are_rounded_up_and_read_as_they_are_written() -> None:
    assert [up(value) for value in (0.0, 1.0, 1.01, 0.0231, 9.5, 3e-15)] == [0.0, 1.0, 2.0, 0.03, 10.0, 3e-15]
    text = PAGE.read_text(encoding="utf-8")
    assert all(line(row) in text for row in read_rows(text).values())


def test_the_references_arithmetic_is_right_to_sixty_digits() -> None:
    """Against identities, and figures of Abramowitz and Stegun."""
    near = Decimal(10) ** -60
    assert abs(s.sin(s.pi() / 6) - s.HALF) < near
    assert abs(s.cos(s.pi() / 3) - s.HALF) < near
    assert abs(4 * s.atan(Decimal(1)) - s.pi()) < near
    assert abs(s.atan2(Decimal(-1), Decimal(-1)) + 3 * s.pi() / 4) < near
    assert str(s.pi()).startswith("3.14159265358979323846264338327950288419716939937510")
    assert abs(s.cube_root(Decimal(27)) - 3) < near
    # The series and the continued fraction meet at 5; 26.2.1 has Φ(1) = 0.84134 47460 68542 94859.
    assert str(s.upper_tail(Decimal(-1))).startswith("0.84134474606854294858")
    x = Decimal(5) + Decimal("1e-9")
    step = s.upper_tail(Decimal(5)) - s.upper_tail(x)
    density = (-(x * x + 25) / 4).exp() / (2 * s.pi()).sqrt() * Decimal("1e-9")
    assert abs(step / density - 1) < Decimal("1e-15")
    assert abs(s.upper_tail(-s.normal_quantile(Decimal("0.025"))) - Decimal("0.025")) < near
    matrix = [[Decimal(2), Decimal(1)], [Decimal(1), Decimal(3)]]
    assert s.solved(matrix, [Decimal(3), Decimal(4)]) == [1, 1]
    assert s.times(s.inverse(matrix), [Decimal(5), Decimal(10)]) == [1, 3]
