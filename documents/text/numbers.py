"""Numbers for people: so many figures without an exponent, and a value with its error to the same place."""

from __future__ import annotations

import math

# Numbers beyond these are written with a power of ten.
_LEAST_EXPONENT, _MOST_EXPONENT = -4, 6
# An error that is a smaller share of its value is not written.
_LEAST_ERROR = 1e-6
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def fixed(value: float | None, digits: int = 4, *, signed: bool = False) -> str:
    """Return a number with fixed digits and a real minus sign; a dash for none, ∞ for an infinite number.

    Where it is ``signed``, a number above zero has a plus sign.
    """
    if value is None or value != value:
        return "–"
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    text = f"{value:,.{digits}f}"
    if not text.strip("-0.,"):
        return text.lstrip("-")
    return f"+{text}" if signed and value > 0 else text.replace("-", "−")


def chance(p: float | None, digits: int = 3) -> str:
    """Return a p value for a table: "0.012", or "< 0.001"."""
    least = 10.0**-digits
    return f"< {least:g}" if p is not None and p < least else fixed(p, digits)


def significant(value: float, figures: int = 3) -> str:
    """Return a number to so many figures, never as 1.1e+02; zeros at the end of its decimals are left out.

    Parameters
    ----------
    value
        Any number.
    figures
        How many figures are kept, at least 1.

    Returns
    -------
    str
        The number; beyond 0.0001 to 10 000 000 with a power of ten, "unknown" for NaN.

    Examples
    --------
    >>> significant(113.7, 2), significant(0.30000, 3), significant(2.5e9), significant(float("nan"))
    ('110', '0.3', '2.5 × 10⁹', 'unknown')
    """
    if not math.isfinite(value):
        return "unknown" if math.isnan(value) else "infinite" if value > 0 else "minus infinite"
    exponent = _exponent(value, figures)
    if not _LEAST_EXPONENT <= exponent <= _MOST_EXPONENT:
        mantissa, power = f"{value:.{figures - 1}e}".split("e")
        return f"{_without_zeros(mantissa)} × 10{str(int(power)).translate(_RAISED)}"
    return _without_zeros(_to_place(value, figures - 1 - exponent))


def with_error(value: float, error: float | None) -> str:
    """Return a value with its standard error, which has two figures, and the value as many decimals.

    Parameters
    ----------
    value
        Any number.
    error
        Its standard error, at least 0; None, NaN or infinite where it is not known.

    Returns
    -------
    str
        Both, with ± between them; the value alone, to four figures, if its error is not known; "unknown" for NaN.

    Examples
    --------
    >>> with_error(132.6, 113.2), with_error(2.28812, 0.00742), with_error(7.1, float("inf"))
    ('130 ± 110', '2.2881 ± 0.0074', '7.1')
    """
    if error is None or not (math.isfinite(value) and math.isfinite(error)):
        return significant(value, 4)
    if error == 0:
        return f"{significant(value, 4)} ± 0"
    if error < _LEAST_ERROR * abs(value):
        return significant(value, 7)
    exponent = _exponent(max(abs(value), error), 2)
    if not _LEAST_EXPONENT <= exponent <= _MOST_EXPONENT:
        scaled = with_error(_scaled(value, exponent), _scaled(error, exponent))
        return f"({scaled}) × 10{str(exponent).translate(_RAISED)}"
    place = 1 - _exponent(error, 2)
    return f"{_to_place(value, place)} ± {_to_place(error, place)}"


def _scaled(value: float, exponent: int) -> float:
    """Return a number without so many powers of ten; these may be more than a float has room for."""
    mantissa, power = f"{value:.16e}".split("e")
    return float(f"{mantissa}e{int(power) - exponent}")


def _exponent(value: float, figures: int) -> int:
    """Return the power of ten of a number's first figure, once it is rounded to so many; 0 for 0."""
    return int(f"{value:.{figures - 1}e}".split("e")[1])


def _to_place(value: float, place: int) -> str:
    """Return a number rounded to a decimal, or with a negative ``place`` to tens and more; zero has no sign."""
    text = f"{round(value, place):.{max(0, place)}f}"
    return text.lstrip("-") if float(text) == 0 else text


def _without_zeros(text: str) -> str:
    return text.rstrip("0").rstrip(".") if "." in text else text
