"""A font of a few letters, as a study or a system may have: each is a filled square, the box for others a bar."""

from __future__ import annotations

from pathlib import Path

from fontTools.fontBuilder import FontBuilder
from fontTools.pens.ttGlyphPen import TTGlyphPen
from fontTools.ttLib.tables._g_l_y_f import Glyph

WIDTH = 1.0  # of each letter, in the size of the type


def tiny_font(file: Path, letters: str, name: str = "Tiny") -> Path:
    """Write a font that has ``letters`` alone, and return its file."""
    names = [".notdef", *(f"u{ord(letter):04X}" for letter in letters)]
    builder = FontBuilder(1000, isTTF=True)
    builder.setupGlyphOrder(names)
    builder.setupCharacterMap({ord(letter): f"u{ord(letter):04X}" for letter in letters})
    builder.setupGlyf({each: _square(100 if each == ".notdef" else 700) for each in names})
    builder.setupHorizontalMetrics(dict.fromkeys(names, (1000, 50)))
    builder.setupHorizontalHeader(ascent=900, descent=-200)
    builder.setupNameTable({"familyName": name, "styleName": "Regular"})
    builder.setupOS2(sTypoAscender=900, sTypoDescender=-200, usWinAscent=900, usWinDescent=200)
    builder.setupPost()
    file.parent.mkdir(parents=True, exist_ok=True)
    builder.save(str(file))
    return file


def _square(height: int) -> Glyph:
    pen = TTGlyphPen(None)
    pen.moveTo((50, 0))
    for place in ((50, height), (950, height), (950, 0)):
        pen.lineTo(place)
    pen.closePath()
    return pen.glyph()
