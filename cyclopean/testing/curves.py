"""The promises of every kind of a display's curves, tried on one: the screen shows what the model says."""

from __future__ import annotations

import numpy as np

from cyclopean.testing.promises import kept
from devices.characterise import fit_display, inversion_error_codes, table_c1_codes, table_error_codes
from devices.display import CURVES, DisplayCurves, ModelSpec
from devices.errors import DeviceError
from devices.readings import Measurements
from documents.yaml import checked, parse_yaml

_CODES = np.linspace(0.0, 1.0, 256)
_GREYS = np.repeat(_CODES[:, None], 3, axis=1)
# A panel of 100 cd/m² and 1000 : 1, its primaries those of sRGB.
_PANEL = """
black_XYZ_cd_m2: [0.095, 0.1, 0.109]
primaries_XYZ_cd_m2: {red: [41.2, 21.3, 1.9], green: [35.8, 71.5, 11.9], blue: [18.0, 7.2, 95.0]}
curve: {%s}
"""
_MOST_DELTA_E = 0.1
"""By how much ΔE00 a fit may be off light that such curves gave, held out."""
_MOST_CODES = 0.5
"""By how many 8-bit codes the screen may be off: then it rounds as the model does, or to the code beside it."""


def prove_curves(entry: str, *, kind: type[DisplayCurves] | None = None) -> tuple[str, ...]:
    """Prove that a kind of a display's curves keeps what the program promises of every kind.

    Parameters
    ----------
    entry
        The curves as they stand under ``curve:``, such as ``"kind: srgb"``.
    kind
        The kind, where its package is not installed.

    Returns
    -------
    tuple of str
        The promises that it kept.

    Raises
    ------
    BrokenPromiseError
        If a promise is not kept.
    InputError
        If the entry itself is wrong.

    Examples
    --------
    >>> "the screen shows what the model says" in prove_curves("kind: srgb")
    True
    """
    source = parse_yaml(_PANEL % entry, "proof.yaml")
    with CURVES.trying(source.data["curve"].get("kind", ""), kind):
        tried = _Tried(checked(source, ModelSpec))
        return kept(
            {
                "more code gives more light": tried.rising,
                "codes come back from light": tried.undone,
                "what cannot be shown is the nearest code": tried.clipped,
                "in other units it is the same display": tried.same_display,
                "the screen shows what the model says": tried.shown,
                "it is read as it was written": tried.written,
            }
            | ({"a fit finds them again": tried.found_again} if type(tried.spec.curve).can_be_fitted() else {})
        )


class _Tried:
    """A display of such curves; each attempt returns what broke."""

    def __init__(self, spec: ModelSpec) -> None:
        self.spec, self._model = spec, spec.model()

    def rising(self) -> str | None:
        for channel, curve in enumerate(self._model.curves):
            light = np.asarray(curve.linear(_CODES))
            if not np.isfinite(light).all() or (np.diff(light) < 0).any() or light[-1] <= light[0]:
                return f"that of channel {channel + 1} does not rise"
        return None

    def undone(self) -> str | None:
        off = inversion_error_codes(self._model)
        return None if off <= 1e-3 else f"they are off by {off:.2g} codes of 8 bits"

    def clipped(self) -> str | None:
        lowest, highest = self._model.limits
        for name, light, wanted in (("less", lowest - 0.1, 0.0), ("more", highest + 0.1, 1.0)):
            found = [float(curve.code(one)) for curve, one in zip(self._model.curves, light, strict=True)]
            if not np.allclose(found, wanted, atol=1e-6):
                return f"for {name} light than any it is {found}"
        return None

    def shown(self) -> str | None:
        off = table_error_codes(self._model)
        return None if off <= _MOST_CODES else f"its table is off by {off:.2g} codes of 8 bits"

    def same_display(self) -> str | None:
        off = np.abs(self._model.normalised.xyz(_GREYS) - self._model.xyz(_GREYS)).max()
        ends = [[float(curve.linear(end)) for end in (0.0, 1.0)] for curve in self._model.normalised.curves]
        if not np.allclose(ends, [0.0, 1.0], atol=1e-9):
            return f"its curves run from {ends}"
        return None if off <= 1e-6 else f"its light differs by {off:.2g} cd/m²"

    def written(self) -> str | None:
        model = checked(parse_yaml("\n".join(self.spec.lines()), "again.yaml"), ModelSpec).model()
        return None if np.array_equal(model.xyz(_GREYS), self._model.xyz(_GREYS)) else "its light is another"

    def found_again(self) -> str | None:
        codes = table_c1_codes()
        try:
            fit = fit_display(Measurements(codes, self._model.xyz(codes)), model=self.spec.curve.kind)
        except DeviceError as error:
            return str(error)
        off = fit.eyes["both"].characterisation.chosen.held_out.max
        return None if off <= _MOST_DELTA_E else f"it is off by {off:.2g} ΔE00"
