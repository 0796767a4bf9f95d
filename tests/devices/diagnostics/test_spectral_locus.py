"""The shipped curve against colour-science."""

from __future__ import annotations

import numpy as np
import pytest

from devices.colour_matching import colorimetric_observer
from devices.diagnostics import locus_line
from devices.diagnostics.chromaticity_diagrams import LOCUS
from devices.diagnostics.colours import chromaticities, outside
from devices.diagnostics.readings import xy
from tests.devices.diagnostics.simulated import characterisation


@pytest.mark.filterwarnings("ignore")
def test_the_locus_is_that_of_cie_1931() -> None:
    nm, x, y = (np.array(column, dtype=np.float64) for column in zip(*LOCUS, strict=True))
    assert np.abs(xy(colorimetric_observer("CIE 1931 2").functions_at(nm)) - np.column_stack([x, y])).max() <= 5.1e-5


def test_each_figure_of_samples_has_it_and_a_display_lies_inside() -> None:
    lines = chromaticities(characterisation()).series[0].lines
    assert lines[0] == locus_line()
    corners = np.column_stack([lines[1].x, lines[1].y])
    assert len(corners) == 3
    # Each primary lies inside some triangle of the horseshoe.
    curve = np.column_stack([lines[0].x, lines[0].y])
    fans = [curve[[0, start, start + 1]] for start in range(1, len(curve) - 1)]
    assert np.min([outside(corners, fan) for fan in fans], axis=0).max() == 0
