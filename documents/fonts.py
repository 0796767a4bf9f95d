"""Which font draws a letter: a study's own, else DejaVu Sans, else one that is installed here.

DejaVu Sans, as matplotlib carries it, has Greek, Cyrillic, accents and arrows, and neither Chinese, Japanese and Korean
nor most emoji. Each letter is drawn by the first font that has it. What is installed is looked for only where a letter
needs it: matplotlib, whose font manager knows, takes a third of a second to import.
"""

from __future__ import annotations

import re
import unicodedata
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from documents.files import open_regular
from documents.findings import Finding, InputError

if TYPE_CHECKING:
    from PIL.ImageFont import FreeTypeFont

_PROBE_PX = 16
_NO_LETTER = "\uffff"  # Unicode assigns none: a font draws its box for a missing letter
# Fonts that draw a box, or nothing, for every letter there is.
_EMPTY = re.compile("last ?resort|adobe ?blank|fallback", re.IGNORECASE)
_NOT_UPRIGHT = re.compile("bold|italic|oblique|black|heavy|light|thin|condensed|mono", re.IGNORECASE)
_PAGE = 256
_UNSEEN = ("Zs", "Zl", "Zp", "Cc", "Cf")
_VARIATION_SELECTORS = re.compile("[\ufe00-\ufe0f\U000e0100-\U000e01ef]")


@lru_cache(maxsize=1)
def dejavu_sans() -> Path:
    """Return the file of DejaVu Sans that matplotlib brings; matplotlib is located, not imported."""
    spec = find_spec("matplotlib")
    folders = spec.submodule_search_locations if spec else None
    if not folders:
        raise FileNotFoundError("matplotlib, whose DejaVu Sans draws the words, is not installed")
    return Path(folders[0]) / "mpl-data" / "fonts" / "ttf" / "DejaVuSans.ttf"


@lru_cache(maxsize=32)
def type_face(font: Path, height_px: int) -> FreeTypeFont:
    """Return a font at a size of type, for Pillow.

    Parameters
    ----------
    font
        A font file with outlines (TrueType or OpenType); the first of a collection.
    height_px
        The size of the type in pixels, at least 1.

    Returns
    -------
    PIL.ImageFont.FreeTypeFont
        The font.

    Raises
    ------
    OSError
        If the file cannot be read or is no font with outlines.

    Examples
    --------
    >>> type_face(font_runs("a")[0][0], 16).getname()
    ('DejaVu Sans', 'Book')
    """
    from PIL import ImageFont

    return ImageFont.truetype(font, height_px)


def font_name(font: Path) -> str:
    """Return what a font calls its family.

    Parameters
    ----------
    font
        A font file with outlines.

    Returns
    -------
    str
        The name, that of the file where it has none.

    Examples
    --------
    >>> font_name(font_runs("a")[0][0])
    'DejaVu Sans'
    """
    return type_face(font, _PROBE_PX).getname()[0] or font.stem


def read_font(font: Path) -> None:
    """Refuse a file that is no font with outlines.

    Parameters
    ----------
    font
        The file.

    Raises
    ------
    InputError
        If it is missing, unreadable, or no such font.

    Examples
    --------
    >>> read_font(font_runs("a")[0][0])
    """
    with open_regular(font, "font"):
        pass
    try:
        type_face(font, _PROBE_PX)
    except OSError as error:
        what = f"this is no font with outlines: {error}"
        raise InputError(Finding(what, str(font), remedy="name a .ttf, .otf or .ttc file")) from error


def font_runs(words: str, own: Path | None = None) -> list[tuple[Path, str]]:
    """Return ``words`` in runs, each with the font that draws it: for each letter the first font that has it.

    Parameters
    ----------
    words
        A line of text.
    own
        A font file that is asked before DejaVu Sans and the fonts that are installed here; None for none.

    Returns
    -------
    list of tuple of (Path, str)
        The font and the letters of each run; at least one run. A letter that no font has is in the first font, which
        draws its box for it. Spaces that a font lacks are plain spaces, and what is not to be seen is left out.

    Examples
    --------
    >>> [(font.name, letters) for font, letters in font_runs("40 µm")]
    [('DejaVuSans.ttf', '40 µm')]
    """
    first = own or dejavu_sans()
    if all(draws(first, letter) for letter in set(words)):
        return [(first, words)]
    runs = [(first, "")]
    for letter in words:
        before, letters = runs[-1]
        font, drawn = _after(before, letter, own)
        if font == before:
            runs[-1] = before, letters + drawn
        else:
            runs.append((font, drawn))
    return [run for run in runs if run[1]] or runs[:1]


def _after(before: Path, letter: str, own: Path | None) -> tuple[Path, str]:
    """Return which font draws ``letter`` after one that ``before`` drew, and as what."""
    if _unseen(letter):
        space = " " if unicodedata.category(letter) == "Zs" else ""
        return before, letter if draws(before, letter) else space
    # A mark above or below stays with its letter where that one's font has it.
    if unicodedata.category(letter).startswith("M") and draws(before, letter):
        return before, letter
    return font_of(letter, own) or own or dejavu_sans(), letter


def undrawable(words: str, own: Path | None = None) -> str:
    """Return the letters of ``words`` that no font here has: they would be empty boxes.

    Parameters
    ----------
    words
        Any text.
    own
        A font file beside DejaVu Sans and the fonts that are installed here; None for none.

    Returns
    -------
    str
        The letters, each once, in the order of their first place; empty if all can be drawn.

    Examples
    --------
    >>> undrawable("Größe 40 µm → ≤ Яблоко")
    ''
    """
    return "".join(letter for letter in dict.fromkeys(words) if not _unseen(letter) and font_of(letter, own) is None)


def other_fonts(words: str, own: Path | None = None) -> dict[Path, str]:
    """Return the fonts other than DejaVu Sans that draw letters of ``words``, with the letters.

    Parameters
    ----------
    words
        Any text.
    own
        A font file that is asked first; None for none.

    Returns
    -------
    dict of Path to str
        The letters that each font draws, each once.

    Examples
    --------
    >>> other_fonts("Größe")
    {}
    """
    found: dict[Path, str] = {}
    for letter in dict.fromkeys(words):
        font = None if _unseen(letter) else font_of(letter, own)
        if font and font != dejavu_sans():
            found[font] = found.get(font, "") + letter
    return found


@lru_cache(maxsize=100_000)
def font_of(letter: str, own: Path | None) -> Path | None:
    """Return the first font that has ``letter``: ``own``, DejaVu Sans, one that is installed; None if none has."""
    for font in (own, dejavu_sans()):
        if font and draws(font, letter):
            return font
    page = ord(letter) // _PAGE
    return next((font for font, pages in installed_fonts() if page in pages and draws(font, letter)), None)


@lru_cache(maxsize=100_000)
def draws(font: Path, letter: str) -> bool:
    """Return whether ``font`` has ``letter``: for a missing letter it draws its box."""
    try:
        drawn, box = (_drawn(font, one) for one in (letter, _NO_LETTER))
    except OSError:  # a font of pictures alone, or one that was taken away
        return False
    return drawn != box


def _drawn(font: Path, letter: str) -> tuple[tuple[int, int], bytes]:
    mask = _probe(font).getmask(letter)
    return mask.size, bytes(mask)


@lru_cache(maxsize=8)
def _probe(font: Path) -> FreeTypeFont:
    from PIL import ImageFont

    return ImageFont.truetype(font, _PROBE_PX, layout_engine=ImageFont.Layout.BASIC)  # a letter by itself, unshaped


@lru_cache(maxsize=1)
def installed_fonts() -> tuple[tuple[Path, frozenset[int]], ...]:
    """Return the fonts that are installed here, upright before others, then those with most letters.

    Each comes with the pages of Unicode, of 256 letters each, of which it has letters: few fonts need to be tried.
    """
    from matplotlib.font_manager import findSystemFonts
    from matplotlib.ft2font import FT2Font

    found = []
    for file in sorted(set(findSystemFonts())):
        try:
            font = FT2Font(file)
            letters = font.get_charmap()
        except (OSError, RuntimeError, ValueError):  # what FreeType cannot read
            continue
        names = f"{font.family_name} {font.style_name} {Path(file).name}"
        if not _EMPTY.search(names):
            pages = frozenset(letter // _PAGE for letter in letters)
            found.append((bool(_NOT_UPRIGHT.search(names)), -len(letters), file, pages))
    return tuple((Path(file), pages) for _, _, file, pages in sorted(found, key=lambda one: one[:3]))


def _unseen(letter: str) -> bool:
    """Return whether there is nothing to see of a letter in any font: a space, a control or formatting character."""
    return unicodedata.category(letter) in _UNSEEN or _VARIATION_SELECTORS.match(letter) is not None
