"""The promises of every check of a display's readings, tried on one: a result in one form, and never an error."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from cyclopean.testing.promises import kept
from devices.diagnostics import DIAGNOSTICS, Diagnosis, DisplayCheck, MeasuredSet, examine
from devices.readings import Measurements, read_measurements

_GREYS = np.linspace(0.0, 1.0, 5)[:, None].repeat(3, axis=1)
_LITTLE = {
    "black alone": Measurements(_GREYS[:1], _GREYS[:1] + 0.1),
    "no light": Measurements(_GREYS, np.zeros((5, 3))),
    "greys": Measurements(_GREYS, 90 * _GREYS + 0.1),
}


def prove_diagnostic(name: str, file: str | Path, *, check: DisplayCheck | None = None) -> tuple[str, ...]:
    """Prove that a check of a display's readings keeps what the program promises of every one.

    Parameters
    ----------
    name
        The name that it is offered by.
    file
        Readings that it judges, as `devices.readings.read_measurements` reads them.
    check
        The check, where its package is not installed.

    Returns
    -------
    tuple of str
        The promises that it kept.

    Raises
    ------
    BrokenPromiseError
        If a promise is not kept.
    InputError
        If the file cannot be read.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from devices.diagnostics import Check
    >>> bright = Check("bright", "White is bright", 80.0, "cd/m²", "our laboratory", at_least=True)
    >>> def judge(readings: Measurements) -> Diagnosis:
    ...     white = readings.XYZ[(readings.codes == 1).all(axis=1), 1]
    ...     if not len(white):
    ...         return bright.unjudged("White was not read.")
    ...     return bright.judged(white.mean(), f"White has {white.mean():.4g} cd/m².")
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "readings.csv")
    ...     _ = file.write_text("R,G,B,X,Y,Z\\n0,0,0,0.1,0.1,0.1\\n1,1,1,95.2,100.1,109.3\\n")
    ...     proved = prove_diagnostic("bright", file, check=DisplayCheck(judge))
    >>> "too little is left open, in a sentence" in proved
    True
    """
    with DIAGNOSTICS.trying(name, check):
        tried = _Tried(name, read_measurements(file))
        return kept(
            {
                "it judges the readings, under its name": tried.judged,
                "what it says of them is JSON": tried.written,
                "it says the same again, and leaves the readings as they are": tried.again,
                "too little is left open, in a sentence": tried.little,
            }
        )


class _Tried:
    """A check of ``readings`` that it judges; each attempt returns what broke."""

    def __init__(self, name: str, readings: Measurements) -> None:
        self._name, self._readings = name, readings

    def _found(self, readings: Measurements) -> Diagnosis | None:
        found = examine([MeasuredSet("proof", readings)])
        return next((one for one in found if one.name == self._name), None)

    def judged(self) -> str | None:
        found = self._found(self._readings)
        if found is None:
            return "nothing of that name is judged"
        return None if found.verdict != "open" else f"it is open: {found.words}"

    def written(self) -> str | None:
        found = self._found(self._readings)
        try:
            json.dumps(found and found.to_json(), allow_nan=False)
        except (TypeError, ValueError) as error:
            return str(error)
        return None

    def again(self) -> str | None:
        before, first = self._readings.XYZ.copy(), self._found(self._readings)
        same = self._found(self._readings) == first and np.array_equal(self._readings.XYZ, before)
        return None if same else "they are not"

    def little(self) -> str | None:
        for what, readings in _LITTLE.items():
            said = DIAGNOSTICS[self._name].judge(readings)
            if said.verdict == "open" and not said.words.endswith("."):
                return f"of {what} it says '{said.words}'"
        return None
