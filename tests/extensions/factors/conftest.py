"""The thesis's ten stimuli with their factors, and answers drawn from known effects."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

from analysis.comparisons import Answer, Comparisons, from_answers
from tests.analysis.conftest import make_session

__all__ = ["make_session"]

ROOT = Path(__file__).parents[3]
# Medina 2016, Table 4.3: exposure time in seconds, luminance scaling factor.
TABLE_4_3 = {"1.1": (1 / 15, 1.0), "1.2": (1 / 15, 0.51), "2.1": (1 / 8, 1.0), "3.1": (1.0, 1.0), "3.2": (1.0, 1.78)}
Factors = Mapping[str, Mapping[str, str | float]]
Drawer = Callable[..., Comparisons]


@pytest.fixture(scope="session")
def thesis() -> tuple[Comparisons, Factors]:
    """Expected counts of 30 observers who answer by Table 4.4, and Table 4.3's factors."""
    stimuli = yaml.safe_load((ROOT / "configs/observers/table_4_4.yaml").read_text())["stimuli"]
    score = {name: told["score"] for name, told in stimuli.items()}
    answers = [Answer(a, b, 30 * score[a] / (score[a] + score[b])) for a in score for b in score if a != b]
    factors = {}
    for name in score:
        image, view = name.split("-")
        exposure_s, scale = TABLE_4_3[image]
        tone_mapped = "yes" if image.endswith(".2") else "no"
        factors[name] = {
            "image": image,
            "view": view,
            "exposure_s": exposure_s,
            "luminance_scale": scale,
            "tone_mapped": tone_mapped,
        }
    return from_answers(answers), factors


@pytest.fixture(scope="session")
def draw() -> Drawer:
    """One answer of each observer to each pair, from strengths in nats."""

    def draw_answers(strengths: Mapping[str, float], observers: int = 12, seed: int = 1) -> Comparisons:
        rng = np.random.default_rng(seed)
        answers = []
        for observer in range(observers):
            for one, other in combinations(strengths, 2):
                chance = 1 / (1 + np.exp(strengths[other] - strengths[one]))
                pair = (one, other) if rng.random() < chance else (other, one)
                answers.append(Answer(*pair, observer=f"{observer:02d}"))
        return from_answers(answers, list(strengths))

    return draw_answers


@pytest.fixture(scope="session")
def grid() -> Factors:
    """Two views of three paints at two exposures."""
    return {
        f"{paint}-{view}-{exposure:g}": {"paint": paint, "view": view, "exposure_s": exposure}
        for paint in ("grey", "blue", "red")
        for view in ("flat", "stereo")
        for exposure in (0.125, 1.0)
    }


def by_hand(answers: Comparisons, columns: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Logistic regression of each answer on the difference of its items' columns: coefficients, log likelihood."""
    from scipy.optimize import minimize

    difference = columns[answers.winner] - columns[answers.loser]

    def loss(beta: NDArray[np.float64]) -> float:
        return float(answers.count @ np.logaddexp(0, -difference @ beta))

    def slope(beta: NDArray[np.float64]) -> NDArray[np.float64]:
        lost = answers.count / (1 + np.exp(difference @ beta))
        return np.asarray(-difference.T @ lost)

    found = minimize(loss, np.zeros(columns.shape[1]), jac=slope, method="BFGS", options={"gtol": 1e-9})
    return np.asarray(found.x), -float(found.fun)


@pytest.fixture(scope="session")
def regression() -> Callable[[Comparisons, NDArray[np.float64]], tuple[NDArray[np.float64], float]]:
    """The slow twin of the fit."""
    return by_hand
