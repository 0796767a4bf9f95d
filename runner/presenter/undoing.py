"""What a colour pass needs beyond a matrix and a table where a display's channels do not add up: files and numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from devices.display.model import DisplayModel
from devices.display.plvc import MIXTURES, MOST_STEPS, NODES, Plvc
from devices.display.table_curve import TableCurve
from runner.presenter.shaders import Uniform

COST = 9
KNOTS_COST = 5


@dataclass(frozen=True, slots=True)
class Undoing:
    """``files`` stand between encoding and pass, with their ``uniforms``.

    ``cost``: times the plain colour pass, about; see benchmarks/plvc_pass.py.
    """

    files: tuple[str, ...] = ()
    uniforms: Mapping[str, Uniform] = field(default_factory=dict)
    cost: int = 1


def undoing(own: DisplayModel, other: DisplayModel | None = None) -> Undoing:
    """Return what undoes how channels act on each other; no files if they do not.

    ``own`` is the model of the eye whose codes are made, ``other`` that of the other eye, where the pass knows of it.
    A model that adds up is one whose channels keep their colour and take nothing from each other.

    Raises
    ------
    DeviceError
        If a model cannot be undone.
    """
    models = (own, other or own)
    if all(model.additive for model in models):
        return Undoing(cost=KNOTS_COST) if any(isinstance(curve, TableCurve) for curve in own.curves) else Undoing()
    terms = [_terms(model) for model in models]
    uniforms: dict[str, Uniform] = {
        "plvc_powers": tuple(row for powers, _, _ in terms for row in powers),
        "plvc_mixtures": tuple(row for _, mixtures, _ in terms for row in mixtures),
        "plvc_steps": (terms[0][2], terms[1][2]),
    }
    return Undoing(("plvc.glsl",), uniforms, cost=COST)


def _terms(model: DisplayModel) -> tuple[list[tuple[float, ...]], list[tuple[float, ...]], int]:
    """Return powers (15, 3), mixtures (10, 3) and the steps to undo them."""
    powers, mixtures, steps = np.zeros((3, len(NODES) + 1, 3)), np.zeros((MIXTURES, 3)), 1
    powers[:, 0] = np.eye(3)
    if isinstance(model, Plvc):
        assert model.steps  # refuses what cannot be undone
        powers, mixtures, steps = model.powers, model.mixtures, MOST_STEPS
    return [tuple(row) for row in powers.reshape(-1, 3).tolist()], [tuple(row) for row in mixtures.tolist()], steps
