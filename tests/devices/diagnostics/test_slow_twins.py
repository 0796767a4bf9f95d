"""What drift and warm-up are found by, against the obvious way: one fit, one patch, one penalty at a time."""

from __future__ import annotations

import numpy as np
import pytest

from devices.diagnostics import readings, settling, time_trend
from devices.measurements import Measurements
from tests.devices.diagnostics.simulated import characterisation


@pytest.mark.parametrize("excess", [0.0, -0.02, -0.3])
def test_one_curve_is_the_best_of_a_least_squares_fit_for_each_time_constant(excess: float) -> None:
    rng = np.random.default_rng(3)
    place = np.repeat([0, 1, 2], [9, 11, 10])
    when = np.concatenate([np.sort(rng.uniform(0, 1800, count)) for count in (9, 11, 10)])
    logs = np.log1p(-0.1 * np.exp(-when / 300)) + 0.2 * place + 0.002 * rng.standard_normal((12, 30))
    taus = np.geomspace(36, 5400, 50)
    found = settling._one_curve(logs, when, place, taus, excess)
    levels = (place[:, None] == np.arange(3)).astype(float)
    for row, series in enumerate(logs):
        fits = []
        for tau in taus:
            fall = np.exp(-when / tau)
            columns = np.column_stack([levels, np.log1p(excess * fall) if excess else fall])
            answer = np.linalg.lstsq(columns, series, rcond=None)[0]
            fits.append((float(((series - columns @ answer) ** 2).sum()), tau, columns @ answer))
        least, tau, fitted = min(fits, key=lambda fit: fit[0])
        assert found.least[row] == pytest.approx(least, rel=1e-9)
        np.testing.assert_allclose(found.fitted[row], fitted, rtol=0, atol=1e-9)
        if row == 0:
            assert found.tau == tau


def test_codes_stand_as_they_were_read_first_with_the_mean_of_their_plain_readings() -> None:
    plain = characterisation(2)
    names = tuple(f"{name}@30deg" if row % 7 == 3 else name for row, name in enumerate(plain.name))
    table = Measurements(plain.codes, plain.XYZ, names, plain.time_s)
    rows = readings.by_code(table)
    assert max(map(len, rows.values())) > 3
    codes, light = readings.means(table)
    np.testing.assert_array_equal(codes, [table.codes[own[0]] for own in rows.values()])
    np.testing.assert_allclose(light, [table.XYZ[own].mean(axis=0) for own in rows.values()], rtol=1e-14, atol=0)


def test_a_smoother_is_the_ridge_regression_on_what_is_within_patches() -> None:
    rng = np.random.default_rng(4)
    _, member, counts = np.unique(np.tile(np.arange(6), 5), return_inverse=True, return_counts=True)
    inside = np.linspace(0, 1, 30)
    rest = time_trend._within(rng.standard_normal(30), member, counts)
    for number in range(6):
        assert rest[member == number].mean() == pytest.approx(0, abs=1e-15)
    tried = 0
    for basis, penalties in time_trend._candidates(inside):
        columns = basis(inside) - np.array([basis(inside)[member == number].mean(axis=0) for number in member])
        fits = list(time_trend._fits(basis, penalties, inside, member, counts))
        assert len(fits) == len(penalties)
        for penalty, fit in zip(penalties, fits, strict=True):
            widened = np.vstack([columns, np.diag(np.sqrt(penalty))])
            answer = np.linalg.lstsq(widened, np.concatenate([rest, np.zeros(len(penalty))]), rcond=None)[0]
            np.testing.assert_allclose(fit.columns @ (fit.operator @ rest), columns @ answer, rtol=0, atol=1e-7)
            tried += 1
    assert tried > 8
