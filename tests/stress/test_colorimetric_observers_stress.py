"""Colorimetric observers pushed to their edges: every field and age, extreme persons, hostile spectra, many objects."""

from __future__ import annotations

import numpy as np
import pytest

from devices.colour_matching import (
    STANDARD_DEVIATIONS,
    Departure,
    colorimetric_observer,
    cone_fundamentals,
    individual_observer,
    individual_observers,
    xyz_from_lms,
)
from devices.diagnostics import ScreenSpectra, observer_metamerism
from devices.readings import sampling_error, xyz_from_spectra

pytestmark = pytest.mark.stress

WAVES = np.arange(390.0, 781.0)


def test_every_field_and_age_gives_functions_of_light() -> None:
    before: np.ndarray | None = None
    for field in np.linspace(1, 10, 19):
        for age in np.linspace(20, 80, 31):
            observer = colorimetric_observer(f"CIE 2006 {field:g} age {age:g}")
            areas = observer.functions.sum(axis=0)
            assert observer.functions.min() >= 0
            np.testing.assert_allclose(areas, areas[1], rtol=1e-9)
            assert 683 <= observer.efficacy_lm_W < 740
            # A year or half a degree changes functions a little, never by a jump.
            if before is not None and age > 20:
                assert np.abs(observer.functions - before).max() < 0.09
            before = observer.functions


def test_the_nearest_locus_is_nearer_than_any_other_that_meets_the_conditions() -> None:
    rng = np.random.default_rng(1)
    for _ in range(40):
        field, age = rng.uniform(1, 10), rng.uniform(20, 80)
        matrix = xyz_from_lms(field, age)
        _, lms = cone_fundamentals(field, age)
        from devices.colour_matching.cie_2006_xyz import _reference_locus

        reference = _reference_locus(field)
        y, z = lms @ matrix[1], lms @ matrix[2]
        place = int(np.argmin((lms @ matrix[0]) / (lms @ matrix.sum(axis=0))))
        least = reference[:, 0].min()
        # The conditions leave one direction free: of the area, and of x where it is least.
        along = np.cross(lms.sum(axis=0), (1 - least) * lms[place])
        along /= np.linalg.norm(along)

        def miss(t: float) -> float:
            x = lms @ (matrix[0] + t * along)  # noqa: B023
            locus = np.stack([x, y, z], axis=1) / (x + y + z)[:, None]  # noqa: B023
            return float(((locus - reference) ** 2).sum())  # noqa: B023

        best = miss(0.0)
        assert all(miss(t) >= best - 1e-9 for t in (-0.1, -0.01, -1e-3, 1e-3, 0.01, 0.1))


def test_persons_six_deviations_out_are_still_observers() -> None:
    rng = np.random.default_rng(5)
    spread = np.array([getattr(STANDARD_DEVIATIONS, name) for name in Departure.__slots__])
    for _ in range(500):
        drawn = np.maximum(rng.uniform(-6, 6, 8) * spread, [-1] * 2 + [-0.99] * 3 + [-99] * 3)
        person = individual_observer("far", rng.uniform(1, 10), rng.uniform(20, 80), Departure(*drawn.tolist()))
        assert np.isfinite(person.functions).all()
        assert 0.5 < person.functions[:, 1].max() < 2


def test_the_stated_sampling_error_is_linear_and_vanishes_for_whole_nanometres() -> None:
    rng = np.random.default_rng(2)
    for _ in range(50):
        spacing = int(rng.integers(1, 21))
        waves = np.arange(380.0, 781.0, spacing)
        if waves[-1] < 700:
            continue
        spectra = rng.random((5, len(waves)))
        one = sampling_error(spectra, waves, "CIE 1964 10")
        assert sampling_error(1e6 * spectra, waves, "CIE 1964 10") == pytest.approx(one, rel=1e-9, abs=1e-14)
        assert one < 1e-12 if spacing == 1 else one > 0
        np.testing.assert_allclose(
            xyz_from_spectra(spectra.sum(axis=0), waves, "CIE 2015 2")[0],
            xyz_from_spectra(spectra, waves, "CIE 2015 2").sum(axis=0),
            rtol=1e-12,
        )


def test_metamerism_does_not_depend_on_units_or_order() -> None:
    rng = np.random.default_rng(3)
    primaries = np.stack([np.exp(-(((WAVES - mid) / 20) ** 2)) for mid in (625, 535, 455)])
    black = np.full(len(WAVES), 1e-4)
    persons = individual_observers(25, 10.0)
    paints = {f"paint {n}": 0.1 + 0.2 * rng.random() + 0.1 * np.sin(WAVES / (40 + 5 * n)) for n in range(20)}
    match = colorimetric_observer("CIE 1964 10")
    lamp = 1 + 0.3 * np.cos(WAVES / 90)

    def found(light: np.ndarray, shapes: dict[str, np.ndarray], scale: float) -> np.ndarray:
        screen = ScreenSpectra(WAVES, scale * black, scale * primaries)
        return np.asarray(
            observer_metamerism(shapes, light, WAVES, screen, persons, matched_for=match).delta_e_00, dtype=float
        )

    first = found(lamp, paints, 1.0)
    np.testing.assert_allclose(found(1e-7 * lamp, paints, 1.0), first, atol=1e-7)
    np.testing.assert_allclose(found(lamp, paints, 1e-5), first, atol=1e-7)
    backwards = dict(reversed(paints.items()))
    np.testing.assert_allclose(found(lamp, backwards, 1.0)[::-1], first, atol=1e-9)
