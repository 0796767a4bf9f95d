"""Colours of classes and of series stay apart in grey and to the colour-blind; others differ by more than colour."""

from __future__ import annotations

import re
import warnings
from itertools import combinations

import numpy as np
import pytest

from analysis.report.bars import BarFigure
from analysis.report.scores import WHITE_FROM, tint
from analysis.series.observer_means import Estimate
from documents.figures import HATCHES, MARKERS, SERIES_COLOURS, class_colours
from documents.figures.palette import CLASS_COLOURS, FURTHER_COLOURS

# ΔE00 of 2 to 3 is what an eye sees of two patches side by side; these lie apart, and in print.
LEAST_DELTA_E, LEAST_DELTA_L = 12.0, 11.0
PAPER, FIRST = "#ffffff", 5
VISIONS = (None, "Protanomaly", "Deuteranomaly", "Tritanomaly")


def lab(colours: tuple[str, ...], vision: str | None = None) -> np.ndarray:
    """Return L*a*b* (n, 3) of colours in sRGB, as seen without one kind of cones [Machado2009]."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import colour
        from colour.blindness import matrix_cvd_Machado2009

        codes = np.array([[int(one[at : at + 2], 16) / 255 for at in (1, 3, 5)] for one in colours])
        linear = colour.models.eotf_sRGB(codes)
        if vision is not None:
            linear = np.clip(linear @ matrix_cvd_Machado2009(vision, 1.0).T, 0, 1)
        xyz = linear @ colour.RGB_COLOURSPACES["sRGB"].matrix_RGB_to_XYZ.T
        return np.asarray(colour.XYZ_to_Lab(xyz, [0.3127, 0.3290]))


@pytest.mark.parametrize("colours", [CLASS_COLOURS, SERIES_COLOURS[:FIRST]], ids=["classes", "series"])
def test_colours_stay_apart(colours: tuple[str, ...]) -> None:
    from colour.difference import delta_E_CIE2000

    for vision in VISIONS:
        seen = lab(colours, vision)
        least = min(float(delta_E_CIE2000(one, other)) for one, other in combinations(seen, 2))
        assert least >= LEAST_DELTA_E, vision
    grey = lab(colours)[:, 0]
    assert min(abs(one - other) for one, other in combinations(grey, 2)) >= LEAST_DELTA_L


def test_the_bound_would_find_the_thesis_s_own_colours_alike() -> None:
    """Green and red of the thesis's figure, to an eye without M cones; blue and red in grey."""
    from colour.difference import delta_E_CIE2000

    green, red, blue = lab(("#2f9e58", "#d03b36", "#3a76d2"), "Deuteranomaly")
    assert float(delta_E_CIE2000(green, red)) < LEAST_DELTA_E
    assert abs(np.diff(lab(("#3a76d2", "#d03b36"))[:, 0])[0]) < LEAST_DELTA_L
    assert blue.shape == (3,)


def test_further_series_differ_by_hatch_and_marker_and_further_classes_by_their_number() -> None:
    assert len(set(HATCHES)) == len(set(MARKERS)) == len(set(SERIES_COLOURS)) == len(HATCHES) == len(SERIES_COLOURS)
    everything = class_colours("+".join(str(number) for number in range(1, 10)))
    assert everything == (*CLASS_COLOURS, *FURTHER_COLOURS)
    assert len(set(everything)) == len(everything)


def test_bars_have_their_hatch_in_the_figure_and_in_its_legend() -> None:
    bars = tuple(f"series {number}" for number in range(8))
    rows = tuple(tuple(Estimate(1.0 + number, 0.5, 9.0, 3, 3) for number in range(8)) for _ in range(3))
    svg = BarFigure("Bars", "group", "unit", ("a", "b", "c"), bars, rows).svg(7.6)
    hatched = re.findall(r"fill: url\(#(h[0-9a-f]+)\)", svg)
    # All but the first; three groups and the legend.
    assert {hatched.count(name) for name in hatched} == {4}
    assert len(set(hatched)) == 7


def _luminance(colour: str) -> float:
    codes = np.array([int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)])
    linear = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def contrast(one: str, other: str) -> float:
    """Return the contrast ratio of WCAG 2.2."""
    dark, bright = sorted((_luminance(one), _luminance(other)))
    return (bright + 0.05) / (dark + 0.05)


def test_text_on_the_page_has_enough_contrast() -> None:
    """Ink, soft words and links, on paper, on the notes' ground and on the wash."""
    from importlib.resources import files

    style = files("documents.pages").joinpath("templates/page.css").read_text(encoding="utf-8")
    named = dict(re.findall(r"--(\w+): (#[0-9a-f]{6})", style))
    notes = re.search(r"\.notes \{[^}]*background: (#[0-9a-f]{6})", style)
    assert notes is not None
    for text in ("ink", "soft", "deep"):
        for ground in (named["paper"], named["wash"], notes.group(1)):
            assert contrast(named[text], ground) >= 4.5, (text, ground)
    for text in re.findall(r"(?<!-)color: (#[0-9a-f]{6})", style):
        assert contrast(text, named["wash"]) >= 4.5, text


def test_counts_can_be_read_on_every_cell_of_the_matrix() -> None:
    for share in np.linspace(0, 1, 201):
        ground = "#{:02x}{:02x}{:02x}".format(*tint(float(share)))
        assert contrast("#ffffff" if share >= WHITE_FROM else "#000000", ground) >= 4.5, share
