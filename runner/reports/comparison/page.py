"""What the page on a comparison says: the verdict, and for each eye pictures, maps, regions and sparkle."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import version
from typing import Any

from documents.arrays import Floats
from documents.figures import Drawing
from documents.pages import (
    Badge,
    Beside,
    Block,
    Cell,
    Column,
    Facts,
    Figure,
    Gallery,
    Page,
    PagePicture,
    Paragraph,
    Section,
    ShownAs,
    Table,
)
from documents.text import fixed, with_error
from runner.reports.comparison.figures import (
    chromaticity_figure,
    delta_e_figure,
    disparity_figure,
    draw_pictures,
    draw_profiles,
    histogram_figure,
    luminance_figure,
    map_figure,
    measure_figures,
)
from runner.reports.display.page import short, typeset
from stimuli.comparison import (
    Comparison,
    EyeComparison,
    Outcome,
    RegionTable,
    decision_sentence,
    outcome_lines,
    passing_heading,
    passing_lines,
)
from stimuli.measures import MeasureTable

_DECISIONS = {
    "validated": Badge("Validated", "good"),
    "not validated": Badge("Not validated", "bad"),
    "cannot say": Badge("Undecided", "open"),
}
_MARKS: Mapping[Outcome, Badge] = {
    "fails": Badge("fails", "bad"),
    "cannot say": Badge("not known", "open"),
    "noted": Badge("noted"),
    "passes": Badge("passes", "good"),
}
_REASONS = (Column("Outcome", "outcome"), Column("Reason", "reason"))
_WAYS = {
    "own": "their own views",
    "exchanged": "each other's views, and were changed back",
    "left twice": "the left view twice",
    "right twice": "the right view twice",
}
# The measures of two eyes as the page's table names them.
_DEPTH_WORDS = {
    "disparity across": "median disparity across, px",
    "disparity down": "median disparity down, px",
    "roll": "right view turned against left, °",
    "relief": "relief: standard deviation of disparity, px",
    "depth scale": "depth, times the photograph's",
    "disparity left": "what depth differs by from place to place, px",
    "eye luminance": "luminance, ln of right over left",
    "eye contrast": "contrast, ln of right over left",
    "eye agreement": "correlation of both views",
    "one-eyed share": "share of sparkles seen by one eye only",
    "sparkle depth": "mean disparity of sparkles from their surface, px",
}


def comparison_page(comparison: Comparison) -> Page:
    """Return what the page says."""
    return Page(
        kind="Objective validation",
        title=f"{comparison.rendering.file.name} beside {comparison.photo.file.name}",
        of=comparison.verdict.decision,
        decision=_DECISIONS[comparison.verdict.decision],
        sentences=(decision_sentence(comparison.verdict),),
        notes=tuple(f"{_sentence(note)}." for note in comparison.notes),
        sections=tuple(_sections(comparison)),
        is_wide=True,
    )


def told(comparison: Comparison) -> Iterator[Block]:
    """Yield what the terminal shows: the verdict, the measures, regions in camera RGB, and what is to be known."""
    yield Paragraph(decision_sentence(comparison.verdict))
    yield from _verdict(comparison)
    measures = comparison.measures
    if measures is not None:
        yield measures.told()
    for result in comparison.eyes.values():
        yield from _camera_rgb(comparison, result)
    of_pictures = [f"{one.file}: {note}" for one in (comparison.photo, comparison.rendering) for note in one.notes]
    for note in (*comparison.notes, *of_pictures, *(measures.remarks() if measures is not None else ())):
        yield Paragraph(f"{note}.", mark=Badge("Note"))


def _sections(comparison: Comparison) -> Iterator[Section]:
    yield Section("verdict", "Verdict", _verdict(comparison))
    for eye, result in comparison.eyes.items():
        of, subject = ("", "") if eye == "both" else (f"-{eye}", f"{eye} eye")
        parts = {
            "Pictures": _pictures(comparison, result),
            "Colour differences": _differences(comparison, result),
            "Profiles": _profiles(result),
            "Regions": _regions(result.table, comparison.verdict.limits.delta_e),
            "Camera RGB": _camera_rgb(comparison, result),
            "Sparkle": _sparkle(result),
        }
        for title, blocks in parts.items():
            if blocks:
                yield Section(f"{title.lower().replace(' ', '-')}{of}", title, tuple(blocks), subject)
    if comparison.measures is not None:
        yield Section("measures", "Measures", _measures(comparison.measures, comparison.options.pixels_per_degree))
    if disparity := _disparity(comparison):
        yield Section("disparity", "Disparity", disparity)
    yield Section("made", "How it was made", _made(comparison))


def _verdict(comparison: Comparison) -> tuple[Block, ...]:
    verdict = comparison.verdict
    outcomes: tuple[Outcome, ...] = ("fails", "cannot say", "noted")
    reasons = [(_MARKS[outcome], line) for outcome in outcomes for line in outcome_lines(verdict, outcome)]
    passing = [(_MARKS["passes"], line) for line in passing_lines(verdict)]
    tables = (("reasons", "", reasons), ("passing", passing_heading(verdict), passing))
    return tuple(
        Table(name, title, _REASONS, tuple((mark, f"{_sentence(line)}.") for mark, line in rows))
        for name, title, rows in tables
        if rows
    )


def _pictures(comparison: Comparison, result: EyeComparison) -> list[Block]:
    white, scaled_by = comparison.options.display_white_XYZ, result.table.scaled_by
    photo, rendering, white_cd_m2 = draw_pictures(
        result.photo, result.rendering, result.table.white_XYZ if white is None else white
    )
    scaled = "" if scaled_by == 1 else f", its light times {short(scaled_by)}"
    pictures = (
        PagePicture(f"Photograph: {comparison.photo.file.name}", (("", photo),)),
        PagePicture(
            f"Rendering, on the photograph's pixels{scaled}: {comparison.rendering.file.name}", (("", rendering),)
        ),
    )
    whose = "CIELAB's white" if white is None else "the display's white"
    tinted = " Light of another white looks tinted here; with --rig or --display the display's white counts."
    words = (
        f"Tone-mapped for this page, both alike: {short(white_cd_m2)} cd/m² in the colour of {whose} is white, what is "
        f"brighter is cut off, and the rest is encoded as sRGB.{tinted if white is None else ''} The numbers below are "
        "of the pictures as they are."
    )
    return [Gallery(pictures, large=True), Paragraph(words, small=True)]


def _differences(comparison: Comparison, result: EyeComparison) -> list[Block]:
    limit, density = comparison.verdict.limits.delta_e, comparison.options.pixels_per_degree
    maps, histograms, rows = [], [], []
    for name, words, seen, summary, overview in (
        ("pixel by pixel", "Pixel by pixel", "", result.per_pixel, result.per_pixel_overview),
        (
            "as seen",
            "As the eye resolves it",
            ""
            if density is None
            else f", at {short(density)} pixels per degree: what cancels at that distance is gone",
            result.seen,
            result.seen_overview,
        ),
    ):
        key = name.replace(" ", "_")
        if overview is not None:
            drawing = map_figure(overview.reduced, f"ΔE00 {words.lower()}, 0 to 10")
            maps.append(Figure(f"map_{key}", drawing, caption=f"{words}{seen}."))
            drawing = histogram_figure(overview, limit, f"How many pixels differ by how much, {words.lower()}")
            histograms.append(Figure(f"histogram_{key}", drawing, caption=f"{words}."))
        if summary is not None:
            numbers = summary.mean, summary.median, summary.p95, summary.p99, summary.largest
            rows.append((name, *numbers, summary.above_limit_percent, summary.pixels))
    columns = (
        Column("ΔE00", "pixels_compared"),
        *_numbers(2, "mean", "median", "95 %", "99 %", "largest"),
        Column(f"above {short(result.per_pixel.limit)}", "above_limit_percent", "number", 2, "%"),
        *_numbers(0, "pixels"),
    )
    words = (
        "Maps show the whole picture, numbers and histograms what lies in the regions and is not saturated. What lies "
        "beyond the rendering's edge is grey."
    )
    table = Table("colour_differences", "", columns, tuple(rows))
    return [Beside((*maps, *histograms)), table, Paragraph(words, small=True)]


def _profiles(result: EyeComparison) -> list[Block]:
    return [
        Figure(f"profile_{number}", drawing, caption=f"Luminance {name}.")
        for number, (name, drawing) in enumerate(
            draw_profiles(result.photo, result.rendering, result.regions.regions), 1
        )
    ]


def _regions(table: RegionTable, limit: float) -> list[Block]:
    luminance = luminance_figure(table, "Luminance of the photograph over that of the rendering")
    chromaticity = chromaticity_figure(table, "Chromaticities, and where the rendering's lie")
    equal = "Luminances, as rendered and times the mean ratio; equal ones lie on the line."
    lie = "Chromaticities of the photograph, and where the rendering's lie."
    blocks: list[Block] = [
        Beside(
            (Figure("luminances", luminance, caption=equal), Figure("chromaticities", chromaticity, caption=lie)),
        )
    ]
    if len(table.rows) > 1:
        blocks.append(Figure("delta_e", delta_e_figure(table, limit, "ΔE00 of each region")))
    blocks += _factor(table)
    colours = tuple(
        (
            _named(row.name, row.excluded),
            *(value for side in (row.photo, row.rendering) for value in (side.x, side.y, side.luminance_cd_m2)),
            *(row.delta_x, row.delta_y, row.delta_xy, row.luminance_ratio),
        )
        for row in table.rows
    )
    columns = (
        Column("Region", "region"),
        *(
            Column(f"{name}{of}", f"{name}{key}", "number", digits)
            for of, key in (("", ""), (" ren.", "_rendering"))
            for name, digits in (("x", 4), ("y", 4), ("Y", 2))
        ),
        *(Column(name, name, "number", 4, signed=True) for name in ("Δx", "Δy")),
        *_numbers(4, "Δxy"),
        *_numbers(3, "Y ratio"),
    )
    blocks.append(Table("regions", "", columns, colours))
    words = (
        "Columns of thesis Tables 5.2 and 5.4. Differences are rendering minus photograph; the Y ratio is photograph / "
        "rendering. Y in cd/m²."
    )
    blocks.append(Paragraph(words, small=True))
    differences = tuple(
        (
            _named(row.name, row.excluded),
            ShownAs(row.delta_e, fixed(row.delta_e, 2), "bad" if row.delta_e > limit and not row.excluded else ""),
            *(row.delta_e_se, row.delta_L, row.delta_C, row.delta_H, row.S_L, row.S_C, row.S_H),
        )
        for row in table.rows
    )
    columns = (
        Column("Region", "region"),
        *_numbers(2, "ΔE00", "±"),
        *(Column(name, name, "number", 2, signed=True) for name in ("ΔL′", "ΔC′", "ΔH′")),
        *_numbers(3, "S_L", "S_C", "S_H"),
    )
    blocks.append(Table("regions_delta_e", "", columns, differences))
    X, Y, Z = map(short, table.white_XYZ)
    words = f"Columns of thesis Tables 5.3 and 5.5. White of CIELAB: X {X}, Y {Y}, Z {Z} cd/m²."
    reasons = [f" {row.name} does not count: {'; '.join(row.excluded)}." for row in table.excluded]
    return [*blocks, Paragraph(words + "".join(reasons), small=True)]


def _factor(table: RegionTable) -> list[Block]:
    """Return the table of the factor between both pictures' luminances, if there is one."""
    if (factor := table.factor) is None:
        return []
    rows: tuple[tuple[Cell, ...], ...] = (
        ("as rendered", "1", _brief(factor.rms_as_rendered), factor.r2_as_rendered),
        (
            "mean ratio",
            _measured(factor.mean_ratio, factor.mean_ratio_se),
            _brief(factor.rms_mean_ratio),
            factor.r2_mean_ratio,
        ),
        (
            "least squares",
            _measured(factor.least_squares, factor.least_squares_se),
            _brief(factor.rms_least_squares),
            factor.r2_least_squares,
        ),
    )
    columns = (
        Column("Luminance, photograph / rendering", "factor_of"),
        *_numbers(0, "factor", "RMS residual (cd/m²)"),
        *_numbers(4, "R²"),
    )
    correlation = (
        ""
        if factor.pearson is None
        else f"Pearson's correlation is {fixed(factor.pearson, 5)}, and no factor changes it; "
    )
    how = (
        "as rendered"
        if table.luminance == "absolute"
        else f"after the rendering was multiplied by {short(table.scaled_by)}"
    )
    words = f"{correlation}R² is about the line of equality. Colours are compared {how}."
    return [Table("luminance_factor", "", columns, rows), Paragraph(words, small=True)]


def _camera_rgb(comparison: Comparison, result: EyeComparison) -> list[Block]:
    if (table := result.camera_rgb) is None:
        return []
    columns = [Column("Region", "region")]
    for letter in "RGB":
        columns += [Column(letter, letter, "number", 2), Column(f"{letter} ren.", f"{letter}_rendering", "number", 2)]
        columns.append(Column(f"Δ{letter}", f"Δ{letter}", "number", 2, signed=True))
    columns += [Column(name, name, "number", 4, signed=True) for name in ("Δr", "Δg")]
    rows = []
    for row in table.rows:
        cells: list[Cell] = [_named(row.name, row.excluded)]
        errors = row.delta_rgb_se or (None, None, None)
        for photo, rendering, delta, error in zip(row.photo_rgb, row.rendering_rgb, row.delta_rgb, errors, strict=True):
            text = fixed(100 * delta, 2, signed=True) + ("" if error is None else f" ± {fixed(100 * error, 3)}")
            cells += [100 * photo, 100 * rendering, ShownAs(100 * delta, text)]
        rows.append((*cells, row.delta_r, row.delta_g))
    channels: tuple[tuple[Cell, ...], ...] = (
        ("photograph / rendering, mean", *(ShownAs(ratio, fixed(ratio, 4)) for ratio in table.mean_ratio_rgb)),
        (
            "root mean square of Δ",
            *(ShownAs(rms, fixed(None if rms is None else 100 * rms, 3)) for rms in table.rms_delta_rgb),
        ),
    )
    scaled = "" if table.scaled_by == 1 else f"; the rendering's light times {short(table.scaled_by)}"
    words = (
        f"{table.title}, in % of full scale, neither calibrated nor white balanced (thesis Section 5.5){scaled}. "
        "Differences are rendering minus photograph; r and g are shares of R + G + B. They do not enter the verdict."
    )
    if comparison.rendering.holds in ("xyz", "rec709"):
        words += (
            " The rendering is XYZ, and its RGB is what the camera's matrix makes of that: what sensor and observer "
            "see differently is not in it."
        )
    full = [row for row in table.rows if row.above_full_scale and not row.excluded]
    if full:
        named = ", ".join(f"{row.name} ({', '.join(row.above_full_scale)})" for row in full)
        words += f" The sensor would be full in {named}."
    return [
        Table("camera_rgb", "", tuple(columns), tuple(rows)),
        Table("camera_rgb_channels", "", (Column("Channel", "channel"), *_numbers(4, *"RGB")), channels),
        Paragraph(words, small=True),
    ]


def _sparkle(result: EyeComparison) -> list[Block]:
    if not result.sparkle:
        return []
    columns = (
        Column("Region", "region"),
        Column("measure", "measure"),
        *_numbers(0, "photograph", "rendering", "difference"),
        *_numbers(1, "z"),
    )
    rows = tuple(
        (
            area.name,
            f"{pair.measure}, {pair.unit}" if pair.unit else pair.measure,
            _measured(pair.photo, pair.photo_se),
            _measured(pair.rendering, pair.rendering_se),
            _percent(pair.relative, pair.relative_se),
            pair.z,
        )
        for area in result.sparkle
        for pair in area.pairs
    )
    words = "A sparkle is twice as bright as its background. Width is full width at half maximum, contrast Weber's. "
    for area in result.sparkle:
        words += (
            f"On '{area.name}' the pictures show other flakes, and standard errors are of flakes at random places. "
            if area.matched is None
            else f"On '{area.name}' {area.matched} sparkles are in both pictures, so that the error of the difference "
            "in density is of the others alone. "
        )
    words += "z is the difference in its own error."
    if not all(area.own_pixels for area in result.sparkle):
        words += " The rendering was turned before, which takes a little off its sparkles."
    return [Table("sparkle", "", columns, rows), Paragraph(words, small=True)]


def _measures(table: MeasureTable, density: float | None) -> tuple[Block, ...]:
    figures = []
    for row in table.rows:
        for eye, drawing in measure_figures(row).items():
            caption = row.measure.title if eye == "both" else f"{row.measure.title}, {eye} eye"
            figures.append(Figure(f"{row.measure.name}_{eye}", drawing, caption=f"{caption}."))
    words = f"Of the pixels in the regions that count, at {short(density)} pixels per degree. "
    words += "They do not enter the verdict."
    if any(row.binocular is not None for row in table.rows):
        words += (
            " The value for both eyes is the mean of both, of a ratio in dB that of the mean square difference; "
            "it says nothing of depth."
        )
    words += "".join(f" {_sentence(remark)}." for remark in table.remarks())
    return table.told(), Paragraph(words, small=True), Beside(tuple(figures))


def _disparity(comparison: Comparison) -> tuple[Block, ...]:
    if (depth := comparison.disparity) is None:
        return ()
    eyes = depth.eyes
    columns = (
        Column("Right eye minus left, px", "picture"),
        *_numbers(2, "median across"),
        Column("95 % of blocks", "blocks_95", "interval", 2),
        *_numbers(2, "median down"),
        *_numbers(0, "blocks used"),
    )
    rows: list[tuple[Cell, ...]] = []
    for name, report in (("photograph", eyes.photo), ("rendering", eyes.rendering)):
        used = ShownAs(report.used, f"{report.used} of {report.blocks}")
        across, down = (spreads["px"] if report.used else None for spreads in (report.horizontal, report.vertical))
        rows.append(
            (
                name,
                None if across is None else across.median,
                None if across is None else (across.low, across.high),
                None if down is None else down.median,
                used,
            )
        )
    blocks: list[Block] = [Table("disparity", "", columns, tuple(rows))]
    if figures := tuple(_depth_figures(eyes.across, eyes.sparkles)):
        blocks.append(Beside(figures))
    if eyes.measures:
        columns = (
            Column("As two eyes see it", "measure"),
            *_numbers(3, "photograph", "rendering"),
            Column("difference", "difference", "number", 3, signed=True),
            *_numbers(3, "±"),
        )
        measures = tuple(
            (_DEPTH_WORDS.get(name, name), one.photo, one.rendering, one.difference, one.standard_error)
            for name, one in eyes.measures.items()
        )
        words = (
            "Differences are rendering minus photograph at the same places, with standard errors by the jackknife over "
            "squares. "
        )
        words += (
            f"The rendering's eyes show {_WAYS[depth.identity.way]}."
            if depth.identity is not None and depth.identity.way is not None
            else "Which view each eye of the rendering shows is not known: it has no texture of the photograph's."
        )
        blocks += [Table("two_eyes", "", columns, measures), Paragraph(words, small=True)]
    return tuple(blocks)


def _depth_figures(across: Floats, sparkles: Sequence[Any] | None) -> Iterator[Figure]:
    """Yield the figures of disparities in squares and of sparkles."""
    drawn: list[tuple[str, str, Any]] = []
    if len(across):
        drawn.append(("squares", "of squares at the same places", (across[:, 0], across[:, 1])))
    if sparkles is not None and all(len(one.disparity_px) for one in sparkles):
        drawn.append(("sparkles", "of sparkles that both eyes see", [one.disparity_px for one in sparkles]))
    for what, words, (photo, rendering) in drawn:
        label = f"How many {what} have which disparity, photograph and rendering"
        figure: Drawing = disparity_figure(photo, rendering, what, label)
        yield Figure(f"disparity_{what}", figure, caption=f"Disparities {words}.")


def _made(comparison: Comparison) -> tuple[Block, ...]:
    facts: list[tuple[str, str]] = []
    steps: list[Block] = []
    for name, picture in (("photograph", comparison.photo), ("rendering", comparison.rendering)):
        width, height = picture.size_px
        notes = "".join(f" {_sentence(note)}." for note in picture.notes)
        facts.append((name.capitalize(), f"{picture.file}, {width} × {height} px, {picture.holds}.{notes}"))
        facts.append((f"SHA-256 of the {name}", picture.sha256 or "–"))
        steps.append(Facts(tuple(map(_step, picture.steps)), folded=f"Steps of the {name}"))
    for eye, result in comparison.eyes.items():
        place = result.alignment
        shift = ", ".join(fixed(value, 3, signed=True) for value in place.shift_px)
        left = "not known" if place.residual_px is None else f"{fixed(place.residual_px, 3)} px"
        how = "Interpolated by a cubic spline in linear light." if place.moved else "Nothing was interpolated."
        words = (
            f"First guess: {place.start}; shift {shift} px, rotation {fixed(place.rotation_deg, 3, signed=True)}°, "
            f"scale {fixed(place.scale, 5)}; residual {left} in {place.squares} of {place.squares_of} squares. {how}"
        )
        facts.append(("Registration" if eye == "both" else f"Registration, {eye} eye", words))
    facts.append(("Regions file", comparison.regions_file))
    facts += [
        (key.replace("_", " ").capitalize(), _plain(value))
        for key, value in comparison.settings.items()
        if key != "regions"
    ]
    limits = comparison.verdict.limits.model_dump()
    facts.append(("Limits", ", ".join(f"{name.replace('_', ' ')} {short(limit)}" for name, limit in limits.items())))
    packages = ("cyclopean", "numpy", "scipy", "opencv-python-headless")
    facts.append(("Versions", ", ".join(f"{name} {version(name)}" for name in packages)))
    return Facts(tuple(facts)), *steps


def _step(step: Mapping[str, Any]) -> tuple[str, str]:
    """Return a step of reading as words."""
    parts = [f"{key.replace('_', ' ')} {_plain(value)}" for key, value in step.items() if key not in ("step", "sha256")]
    return str(step.get("step", "")).replace("_", " "), ", ".join(parts)


def _numbers(digits: int, *headings: str) -> Iterator[Column]:
    return (Column(heading, heading, "number", digits) for heading in headings)


def _sentence(text: str) -> str:
    return typeset(text[:1].upper() + text[1:])


def _named(name: str, excluded: object) -> str:
    return f"{name} (excluded)" if excluded else name


def _brief(value: float | None) -> ShownAs:
    return ShownAs(value, short(value))


def _measured(value: float | None, error: float | None) -> ShownAs:
    """Return a number with its error, a dash for none."""
    if value is None or not math.isfinite(value):
        return ShownAs(value, fixed(value, 0))
    return ShownAs(value, with_error(value, error).replace("-", "−"))


def _percent(share: float, error: float | None) -> ShownAs:
    """Return a share and its error in percent, with its sign."""
    shown = _measured(100 * share, None if error is None else 100 * error)
    plus = "+" if share > 0 and shown.text[:1].isdigit() and float(shown.text.split()[0]) > 0 else ""
    return ShownAs(shown.value, f"{plus}{shown.text} %")


def _plain(value: Any) -> str:
    if isinstance(value, tuple | list):
        return " ".join(str(item) for item in value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)
