"""What figures share: type, and SVG that goes into a page."""

from __future__ import annotations

import io
import re
import unicodedata
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from documents.figures.palette import FAINT, INK
from documents.fonts import dejavu_sans, font_name, font_runs, other_fonts
from documents.text import significant
from documents.work import count_work

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

WIDE_IN, NARROW_IN = 7.6, 4.2
LONGEST_NAME = 26


@contextmanager
def drawing(salt: str, width_in: float, height_in: float, *, hatch_pt: float = 1.0) -> Iterator[tuple[Figure, Axes]]:
    """Yield a figure with axes on no ground; equal ``salt`` and content give equal SVG.

    Parameters
    ----------
    salt
        What the names in the SVG are derived from, such as the name of the figure.
    width_in
        Width in inches, above 0.
    height_in
        Height in inches, above 0.
    hatch_pt
        Width of the lines of hatches in points, above 0.

    Yields
    ------
    tuple of (matplotlib.figure.Figure, matplotlib.axes.Axes)
        The figure and its axes; save the figure inside the ``with`` block.

    Examples
    --------
    >>> with drawing("scores", 4.0, 2.0) as (figure, axes):
    ...     lines = axes.plot([0, 1], [0, 1])
    ...     finished = drawn(figure, "Scores")
    >>> "Scores" in finished.svg
    True
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    style: dict[str, Any] = {
        "svg.fonttype": "none",
        "svg.hashsalt": f"{salt}-{width_in:g}",
        "text.parse_math": False,
        "font.size": 10.0,
        "hatch.linewidth": hatch_pt,
    }
    with rc_context(style):  # type: ignore[arg-type]  # its keys are known names to the stubs, and plain text here
        figure = Figure(figsize=(width_in, height_in), layout="constrained")
        figure.patch.set_alpha(0)
        axes = figure.subplots()
        axes.patch.set_alpha(0)
        yield figure, axes


@dataclass(frozen=True, slots=True, eq=False)
class Drawing:
    """A finished figure, from `drawn`.

    Attributes
    ----------
    svg
        An ``<svg>`` element to be set into an HTML page: without XML prologue, metadata and fixed size.
    label
        What it shows, for screen readers and as the title of its files.
    figure
        The figure itself.
    hatch_pt
        Width of the lines of its hatches in points.

    Examples
    --------
    >>> with drawing("scores", 4.0, 2.0) as (figure, axes):
    ...     finished = drawn(figure, "Scores")
    >>> finished.pdf()[:5], finished.svg_file().split()[0]
    (b'%PDF-', '<?xml')
    """

    svg: str
    label: str
    figure: Figure
    hatch_pt: float = 1.0

    def svg_file(self) -> str:
        """Return the ``svg`` of the page as a file of its own, as large as the figure.

        Returns
        -------
        str
            An SVG file; it says its encoding, UTF-8.
        """
        width_in, height_in = self.figure.get_size_inches().tolist()
        size = f'width="{width_in:g}in" height="{height_in:g}in"'
        spaces = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
        return f'<?xml version="1.0" encoding="utf-8"?>\n{self.svg.replace("<svg ", f"<svg {spaces} {size} ", 1)}\n'

    def pdf(self) -> bytes:
        """Return the figure as PDF, with its letters as text in an embedded font.

        Returns
        -------
        bytes
            A PDF file of one page, the same for the same figure.
        """
        from matplotlib import rc_context
        from matplotlib.backends.backend_pdf import FigureCanvasPdf

        out = io.BytesIO()
        style: dict[str, Any] = {"pdf.fonttype": 42, "hatch.linewidth": self.hatch_pt}
        facts = {"Title": self.label, "Creator": "cyclopean", "CreationDate": None}
        with rc_context(style), _drawn_once(self.figure):  # type: ignore[arg-type]  # as above
            FigureCanvasPdf(self.figure).print_pdf(out, metadata=facts)  # type: ignore[no-untyped-call]  # untyped there
        return out.getvalue()


def drawn(figure: Figure, label: str) -> Drawing:
    """Finish a figure from `drawing`, inside its ``with`` block.

    Parameters
    ----------
    figure
        The figure, from `drawing`.
    label
        A description for screen readers; it is escaped.

    Returns
    -------
    Drawing
        The figure as SVG for a page, and what is needed to save it as a file.

    Examples
    --------
    >>> with drawing("scores", 4.0, 2.0) as (figure, axes):
    ...     finished = drawn(figure, "Scores & classes")
    >>> finished.svg.startswith("<svg viewBox="), 'aria-label="Scores &amp; classes"' in finished.svg
    (True, True)
    """
    from markupsafe import escape
    from matplotlib import rcParams
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    count_work("figures_drawn")
    _take_other_fonts(figure)
    _write_numbers_of_logarithmic_axes(figure)
    out = io.StringIO()
    with _drawn_once(figure):
        facts = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        FigureCanvasSVG(figure).print_svg(out, metadata=facts)  # type: ignore[no-untyped-call]  # untyped there
    svg = out.getvalue()
    body = re.sub(r"<metadata>.*?</metadata>", "", svg[svg.index("<svg") :], flags=re.DOTALL)
    head, rest = body.split(">", 1)
    view = re.search(r'viewBox="[^"]*"', head)
    element = f'<svg {view.group(0) if view else ""} role="img" aria-label="{escape(label)}">{rest.rstrip()}'
    return Drawing(element, label, figure, rcParams["hatch.linewidth"])


def _write_numbers_of_logarithmic_axes(figure: Figure) -> None:
    """Have numbers beside logarithmic axes: matplotlib writes powers in markup, which nothing here reads."""
    from matplotlib.ticker import LogFormatter

    class Plain(LogFormatter):
        def __call__(self, value: float, pos: int | None = None) -> str:
            return significant(value) if super().__call__(value, pos) else ""

    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if axis.get_scale() == "log":
                for get, put in (
                    (axis.get_major_formatter, axis.set_major_formatter),
                    (axis.get_minor_formatter, axis.set_minor_formatter),
                ):
                    if isinstance(get(), LogFormatter):
                        put(Plain())


def _take_other_fonts(figure: Figure) -> None:
    """Give the texts of a figure the fonts that are installed here for letters that matplotlib's font lacks."""
    from matplotlib.text import Text

    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            axis.get_ticklabels()  # the names of ticks are not written before
    for text in figure.findobj(Text):
        if isinstance(text, Text) and (fonts := other_fonts(text.get_text())):
            text.set_fontfamily(["DejaVu Sans", *map(_family, fonts), "sans-serif"])


def _family(font: Path) -> str:
    """Return the name of a font by which matplotlib finds the file."""
    from matplotlib.font_manager import FontEntry, fontManager

    name, file = font_name(font), str(font)
    known = {entry.weight for entry in fontManager.ttflist if entry.name == name}
    for weight in {400, 700} - known:  # of a weight that a font has not, matplotlib writes a line to the terminal
        fontManager.ttflist.append(FontEntry(fname=file, name=name, weight=weight))
    return name


@contextmanager
def _drawn_once(figure: Figure) -> Iterator[None]:
    """Write a figure by its canvas, which draws it once, the layout included: ``savefig`` would draw it twice."""
    dpi = figure.dpi
    try:
        with without_drawing_warnings():
            yield
    finally:
        figure.dpi = dpi  # a canvas of vectors leaves 72


@contextmanager
def without_drawing_warnings() -> Iterator[None]:
    """Save a figure without matplotlib's warnings that say nothing about it.

    A browser has its own fonts: a letter that matplotlib's lacks is no fault of the page. And whether it takes a second
    to find a legend's place depends on what else the machine does.

    Examples
    --------
    >>> with without_drawing_warnings():
    ...     warnings.warn('Creating legend with loc="best" can be slow with large amounts of data.')
    """
    with warnings.catch_warnings():
        for message in ("Glyph .* missing from", "Creating legend with loc"):
            warnings.filterwarnings("ignore", message=message)
        yield


def rows_only(axes: Axes, rows: int) -> None:
    """Draw faint lines along the rows and leave only the lower axis.

    Parameters
    ----------
    axes
        The axes to change.
    rows
        The number of rows, at y = 0, 1 and so on, at least 0.

    Examples
    --------
    >>> with drawing("scores", 4.0, 2.0) as (figure, axes):
    ...     rows_only(axes, 3)
    >>> axes.spines["left"].get_visible(), axes.spines["bottom"].get_visible()
    (False, True)
    """
    axes.hlines(range(rows), 0, 1, transform=axes.get_yaxis_transform(), color=FAINT, linewidth=0.7, zorder=1)
    axes.tick_params(axis="y", length=0, colors=INK)
    axes.tick_params(axis="x", colors=INK)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.spines["bottom"].set_color(INK)


def row_names(axes: Axes, names: Mapping[int, str], side: Literal["left", "right"] = "left", **style: Any) -> None:
    """Write names beside rows where labels of ticks would stand, each measured once; the y axis gets no ticks.

    A tick is made of three lines and two texts, and each layout measures them all several times.

    Parameters
    ----------
    axes
        The axes to change.
    names
        The name of each row, by the row's y; no two lines of text.
    side
        Beside which edge of the axes they stand.
    **style
        Properties of the text, such as ``fontweight``.

    Examples
    --------
    >>> with drawing("scores", 4.0, 2.0) as (figure, axes):
    ...     row_names(axes, {0: "plate", 1: "sphere"})
    >>> [(text.get_text(), text.get_in_layout()) for text in axes.texts]
    [('plate', False), ('sphere', True)]
    """
    from matplotlib.textpath import text_to_path

    axes.set_yticks([])
    beside = axes.get_yaxis_text1_transform if side == "left" else axes.get_yaxis_text2_transform
    place, vertical, horizontal = beside(_NAME_PT)
    look = {"transform": place, "va": vertical, "ha": horizontal, "color": INK, **style}
    texts = [axes.text(float(side == "right"), row, name, in_layout=False, **look) for row, name in names.items()]

    def width(text: Text) -> float:
        font = text.get_fontproperties()
        measured: float = text_to_path.get_text_width_height_descent(text.get_text(), font, False)[0]
        other = sum(len(letters) for file, letters in font_runs(text.get_text()) if file != dejavu_sans())
        return measured + _WIDER * other * font.get_size_in_points()

    if texts:
        with without_drawing_warnings():
            max(texts, key=width).set_in_layout(True)


_NAME_PT = 3.5  # between a name and the axes
_WIDER = 0.4  # than DejaVu Sans's box is a Chinese letter, in the size of the type


def short(name: str, longest: int = LONGEST_NAME) -> str:
    """Return a name that fits beside a row.

    Parameters
    ----------
    name
        A name of any length.
    longest
        The room that there is, in letters of usual width, at least 2.

    Returns
    -------
    str
        The name, cut where it takes more room, with an ellipsis last: after 26 letters, and after fewer wide ones.

    Examples
    --------
    >>> short("manitoba")
    'manitoba'
    >>> len(short("a" * 40)), len(short("W" * 40))
    (26, 16)
    """
    if len(name) <= longest and _letters(name) <= longest:
        return name
    kept = name[: longest - 1]
    while kept and _letters(kept) > longest - 1:
        kept = kept[:-1]
    return kept + "…"


def _letters(text: str) -> float:
    """Return the width of ``text`` in letters of usual width."""
    return sum(
        1.8
        if unicodedata.east_asian_width(letter) in "FW"
        else 1.6
        if letter in "WM@%"
        else 1.15
        if letter.isupper()
        else 1
        for letter in text
    )
