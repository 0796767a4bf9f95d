"""What people read of a fit: the thesis's tables, every candidate, the chosen one's numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

from devices.characterise.channel_fit import COEFFICIENTS
from devices.characterise.choose import Candidate
from devices.characterise.fit_numbers import FitNumber, ModelNumbers
from devices.characterise.thesis import ThesisFits
from documents.arrays import Floats
from documents.pages import Table


def notes(sentences: Iterable[str]) -> Iterator[str]:
    """Yield each sentence as a note, closed by one full stop or its question mark."""
    for sentence in sentences:
        yield f"Note: {sentence}" if sentence.endswith((".", "?")) else f"Note: {sentence}."


def _table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]], words: int = 1) -> Table:
    """Return a table whose first ``words`` columns are text; of several, the first stands only where it changes."""
    shown, before = [], ""
    for row in rows:
        shown.append(["" if words > 1 and row[0] == before else row[0], *row[1:]])
        before = row[0]
    return Table.of_texts(title, columns, shown, range(words))


def candidates_table(candidates: Sequence[Candidate], chosen: str) -> Table:
    """Return every candidate with its held-out errors; an arrow at the chosen one."""
    rows = [
        [
            ("→ " if candidate.name == chosen else "  ") + candidate.name,
            str(candidate.free_numbers),
            *(f"{value:.2f}" for value in (candidate.held_out.mean, candidate.held_out.p95, candidate.held_out.max)),
            "–" if candidate.worst_light is None else candidate.worst_light.size,
            f"{candidate.fitted.mean:.2f}",
            _number(candidate.r2_average),
            _number(candidate.condition, ".0f"),
            _number(candidate.inversion_error_codes, ".1g"),
            _number(candidate.table_error_codes, ".1g"),
        ]
        for candidate in candidates
    ]
    columns = ("model", "free", "mean", "p95", "max", "light", "fit", "R²", "cond.", "inv.", "table")
    title = (
        "Held-out ΔE00 (light: by how much luminance is off in the worst decade; inv. and table: errors of the inverse "
        "and of the presenter's table in 8-bit codes)"
    )
    return _table(title, columns, rows)


def curves_tables(numbers: ModelNumbers) -> Iterator[Table]:
    """Yield the chosen model's curves with their standard errors, where the fit gives them."""
    if numbers.curves:
        names = ("gain", "offset", "gamma")
        rows = [[name, *(_estimate(curve[name]) for curve in numbers.curves.values())] for name in names]
        yield _table("Its curves, ± standard error", ["", *numbers.curves], rows)


def black_words(numbers: ModelNumbers, read_XYZ_cd_m2: Floats | None) -> str:
    """Return the light of code 0 by the model, and as it was read.

    A model's own term is not that light where its curves have offsets, so that errors are of the term alone.
    """
    shown = numbers.shown_black_XYZ_cd_m2
    terms = numbers.black_XYZ_cd_m2.values()
    plain_term = all(abs(light - term.value) < 1e-9 for light, term in zip(shown, terms, strict=True))
    by_model = map(_estimate, terms) if plain_term else (f"{light:.4f}" for light in shown)
    words = ", ".join(f"{axis} {value}" for axis, value in zip("XYZ", by_model, strict=True))
    if read_XYZ_cd_m2 is not None:
        read = ", ".join(f"{axis} {light:.4f}" for axis, light in zip("XYZ", read_XYZ_cd_m2, strict=True))
        words += f"; it was read as {read}"
    return f"Its black (code 0), in cd/m²: {words}"


def thesis_tables(fits: ThesisFits) -> Iterator[Table]:
    """Yield the fits by the thesis's two methods, as its tables have them."""
    for number, way, direct in (
        ("3.3", "XYZ from code", fits.XYZ_from_code),
        ("3.4", "code from XYZ", fits.code_from_XYZ),
    ):
        rows = [[row.kind, row.channel, *map(_number, (*row.r2_XYZ, row.average))] for row in direct]
        columns = ("", "", "R² X", "R² Y", "R² Z", "average")
        yield _table(f"The thesis's first method, {way} (as Table {number})", columns, rows, words=2)
    for number, way, kinds in (
        ("3.6", "light from code", fits.forward),
        ("3.5", "code from light", fits.inverse),
    ):
        rows = []
        for kind, channels in kinds.items():
            for place, name in enumerate(COEFFICIENTS):
                pairs = [(fit.coefficients[place], fit.standard_errors[place]) for fit in channels]
                if any(error for _, error in pairs):
                    rows.append([kind, name, *(f"{value:.4f} ± {error:.4f}" for value, error in pairs)])
            rows.append([kind, "R²", *(_number(fit.r2) for fit in channels)])
            rows.append([kind, "condition", *(_number(fit.condition, ".0f") for fit in channels)])
        title = f"Its second method, {way} (as Table {number}), ± standard error; codes in 0..1"
        yield _table(title, ("", "", "red", "green", "blue"), rows, words=2)


def _number(value: float | None, form: str = ".4f") -> str:
    return "–" if value is None or not math.isfinite(value) else f"{value:{form}}"


def _estimate(number: FitNumber) -> str:
    error = number.standard_error
    return f"{number.value:.4f}" if error is None else f"{number.value:.4f} ± {error:.4f}"
