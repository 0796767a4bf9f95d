"""Arithmetic on `decimal` that is right to sixty digits, with angles, normal tails and linear systems.

Everything is computed with `DIGITS` digits, and every series runs until it no longer changes the sum.
"""

from __future__ import annotations

import decimal
from collections.abc import Callable, Iterable, Sequence
from decimal import Decimal
from functools import cache
from itertools import count
from typing import Any

DIGITS = 80
decimal.getcontext().prec = DIGITS
Matrix = list[list[Decimal]]
ZERO, ONE, TWO, HALF = Decimal(0), Decimal(1), Decimal(2), Decimal("0.5")


def exact(numbers: Iterable[Any]) -> list[Decimal]:
    """Return floats as they are, to the last bit."""
    return [Decimal(float(number)) for number in numbers]


def _sum(terms: Callable[[int], Decimal]) -> Decimal:
    total = ZERO
    for n in count():
        term = terms(n)
        if abs(term) <= abs(total) * Decimal(10) ** -(DIGITS + 2) and n:
            return total
        total += term
    raise AssertionError


def _small_atan(x: Decimal) -> Decimal:
    square, power = -x * x, x

    def term(n: int) -> Decimal:
        nonlocal power
        now, power = power / (2 * n + 1), power * square
        return now

    return _sum(term) if x else ZERO


@cache
def pi() -> Decimal:
    """Return π by Machin's formula."""
    return 4 * (4 * _small_atan(ONE / 5) - _small_atan(ONE / 239))


def atan(x: Decimal) -> Decimal:
    """Return the arc tangent."""
    if abs(x) > Decimal("0.1"):
        return 2 * atan(x / (1 + (1 + x * x).sqrt()))
    return _small_atan(x)


def atan2(y: Decimal, x: Decimal) -> Decimal:
    """Return the angle of (x, y), −π to π; 0 of nothing."""
    if x > 0:
        return atan(y / x)
    if x < 0:
        return atan(y / x) + (pi() if y >= 0 else -pi())
    return ZERO if y == 0 else (pi() / 2).copy_sign(y)


def sin(x: Decimal) -> Decimal:
    """Return the sine."""
    turns = (x / (2 * pi())).to_integral_value()
    x = (x - turns * 2 * pi()) / 27
    power, square = x, -x * x

    def term(n: int) -> Decimal:
        nonlocal power
        now = power
        power = power * square / ((2 * n + 2) * (2 * n + 3))
        return now

    value = _sum(term) if x else ZERO
    for _ in range(3):
        value = 3 * value - 4 * value**3
    return value


def cos(x: Decimal) -> Decimal:
    """Return the cosine."""
    return sin(x + pi() / 2)


def radians(degrees: Decimal) -> Decimal:
    """Return an angle in radians."""
    return degrees * pi() / 180


def cube_root(x: Decimal) -> Decimal:
    """Return the cube root."""
    return (abs(x).ln() / 3).exp().copy_sign(x) if x else ZERO


def power(x: Decimal, exponent: Decimal) -> Decimal:
    """Return ``x`` to ``exponent``, x at least 0."""
    return (x.ln() * exponent).exp() if x > 0 else ZERO


def upper_tail(x: Decimal) -> Decimal:
    """Return the normal distribution's 1 − Φ(x), by its series up to 5 and Laplace's continued fraction beyond."""
    density = (-x * x / 2).exp() / (2 * pi()).sqrt()
    if x < 0:
        return 1 - upper_tail(-x)
    if x > 5:
        fraction = x
        for n in range(2000, 0, -1):
            fraction = x + n / fraction
        return density / fraction
    term = x

    def series(n: int) -> Decimal:
        nonlocal term
        now, term = term, term * x * x / (2 * n + 3)
        return now

    return HALF - density * (_sum(series) if x else ZERO)


def normal_quantile(level: Decimal) -> Decimal:
    """Return x with Φ(x) = ``level``, by Newton's method."""
    x = ZERO
    for _ in range(400):
        density = (-x * x / 2).exp() / (2 * pi()).sqrt()
        step = (upper_tail(-x) - level) / density
        step = max(min(step, ONE / 2), -ONE / 2)
        x -= step
        if abs(step) < Decimal(10) ** -60:
            return x
    raise AssertionError(level)


def times(matrix: Matrix, vector: Sequence[Decimal]) -> list[Decimal]:
    """Return matrix · vector."""
    return [sum((a * b for a, b in zip(row, vector, strict=True)), ZERO) for row in matrix]


def solved(matrix: Matrix, right: Sequence[Decimal]) -> list[Decimal]:
    """Return x with matrix · x = right, by elimination with pivots."""
    rows = [[*row, value] for row, value in zip(matrix, right, strict=True)]
    size = len(rows)
    for column in range(size):
        pivot = max(range(column, size), key=lambda row: abs(rows[row][column]))
        rows[column], rows[pivot] = rows[pivot], rows[column]
        for row in range(size):
            if row != column:
                share = rows[row][column] / rows[column][column]
                rows[row] = [a - share * b for a, b in zip(rows[row], rows[column], strict=True)]
    return [rows[i][size] / rows[i][i] for i in range(size)]


def inverse(matrix: Matrix) -> Matrix:
    """Return the inverse."""
    size = len(matrix)
    columns = [solved(matrix, [ONE if i == j else ZERO for i in range(size)]) for j in range(size)]
    return [[columns[j][i] for j in range(size)] for i in range(size)]
