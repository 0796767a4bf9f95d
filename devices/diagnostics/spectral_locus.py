"""The chromaticities of light of one wavelength, for figures: CIE 1931 2°, to four digits [CIE2018]."""

from __future__ import annotations

from devices.diagnostics.diagnosis import Line

# Wavelength in nm, x, y; closer together where the curve bends.
LOCUS: tuple[tuple[int, float, float], ...] = (
    (400, 0.1733, 0.0048),
    (430, 0.1689, 0.0069),
    (440, 0.1644, 0.0109),
    (450, 0.1566, 0.0177),
    (455, 0.1510, 0.0227),
    (460, 0.1440, 0.0297),
    (465, 0.1355, 0.0399),
    (470, 0.1241, 0.0578),
    (475, 0.1096, 0.0868),
    (480, 0.0913, 0.1327),
    (485, 0.0687, 0.2007),
    (490, 0.0454, 0.2950),
    (495, 0.0235, 0.4127),
    (500, 0.0082, 0.5384),
    (505, 0.0039, 0.6548),
    (510, 0.0139, 0.7502),
    (515, 0.0389, 0.8120),
    (520, 0.0743, 0.8338),
    (525, 0.1142, 0.8262),
    (530, 0.1547, 0.8059),
    (535, 0.1929, 0.7816),
    (540, 0.2296, 0.7543),
    (550, 0.3016, 0.6923),
    (560, 0.3731, 0.6245),
    (570, 0.4441, 0.5547),
    (580, 0.5125, 0.4866),
    (590, 0.5752, 0.4242),
    (600, 0.6270, 0.3725),
    (620, 0.6915, 0.3083),
    (640, 0.7190, 0.2809),
    (700, 0.7347, 0.2653),
)


def locus_line() -> Line:
    """Return the horseshoe of real colours in x, y, closed by the line of purples."""
    return Line("real colours", tuple(x for _, x, _ in LOCUS), tuple(y for _, _, y in LOCUS), "soft", "outline")
