"""What a measure of two pictures is: a kind with a name, a unit and a direction."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Floats32
from stimuli.measures.viewing import ViewingConditions
from stimuli.pictures.rows import Rows


@dataclass(frozen=True, eq=False, slots=True)
class EyeMeasured:
    """What a measure says of one eye's pictures.

    ``value`` is in the measure's unit. ``error_map``, float32 (height, width), is what it says of each pixel, larger
    where the pictures differ more, or None for a measure without a map. ``remarks`` say what was assumed.
    """

    value: float
    error_map: Floats32 | None = None
    remarks: tuple[str, ...] = ()


class Measure(ABC):
    """A measure of how far the test picture of one eye is from its reference; a class is found by its name.

    What it says of itself is all that tables, pages and messages know of it. `binocular` makes one value of two eyes'.
    """

    name: ClassVar[str]
    """As it is typed: ``flip``."""
    title: ClassVar[str]
    """As it is printed."""
    unit: ClassVar[str]
    """Such as dB; empty for a number without a unit."""
    better: ClassVar[Literal["lower", "higher"]]
    identical: ClassVar[float]
    """Its value for two identical pictures."""
    source: ClassVar[str]
    """The key of its publication in ``docs/references.md``; of another package's, the publication itself."""
    symmetric: ClassVar[bool] = False
    """Whether its value stays where reference and test picture are exchanged."""
    map_title: ClassVar[str] = "error"
    """What its error map shows, with its unit."""
    map_highest: ClassVar[float | None] = None
    """The upper end of the scale on which its error map is drawn; None for the map's own largest value."""
    needs_display_white: ClassVar[bool] = False
    """Whether the white of the display must be known."""
    package: ClassVar[str | None] = None
    """The module that must be there for it, beyond the own dependencies of the distribution that it is of."""
    extra: ClassVar[str | None] = None
    """Of one of ours, the extra of this distribution that installs it: ``pip install '.[vdp]'``."""

    @property
    def is_installed(self) -> bool:
        """Whether its package is there; the package is not imported for it."""
        return self.package is None or find_spec(self.package) is not None

    @property
    def missing(self) -> str | None:
        """What to type to install what it needs; None where nothing is missing."""
        if self.is_installed:
            return None
        return f"pip install '.[{self.extra}]'" if self.extra else f"pip install {self.package}"

    @abstractmethod
    def measure(self, reference_XYZ: Rows, test_XYZ: Rows, viewing: ViewingConditions) -> EyeMeasured:
        """Return how far a test picture is from its reference.

        Parameters
        ----------
        reference_XYZ, test_XYZ
            XYZ in cd/m², finite and 0 or above, of one shape (height, width, 3): arrays, or anything whose rows can be
            sliced.
        viewing
            How they are seen.

        Returns
        -------
        EyeMeasured
            The value in ``unit``, and the map of the error.

        Raises
        ------
        StimulusError
            If what the measure needs of the viewing conditions is not known, or it cannot take pictures of this size.
        """

    def pooled(self, errors: NDArray[np.float32]) -> float | None:
        """Return the value of the pixels whose errors, (n,), these are; None if it does not follow from the map."""
        return None

    def binocular(self, values: Sequence[float]) -> float:
        """Return the value for both eyes of those of each: their mean."""
        return sum(values) / len(values)


class MapMeasure(Measure):
    """A measure whose value follows from its error map: pixels can be left out, and both eyes taken together.

    Unless `pooled` is replaced, the value is the mean of the map.
    """

    @abstractmethod
    def error_map(self, reference_XYZ: Rows, test_XYZ: Rows, viewing: ViewingConditions) -> Floats32:
        """Return the error of each pixel, float32 (height, width); parameters are those of `measure`."""

    def pooled(self, errors: NDArray[np.float32]) -> float:
        """Return the value of the pixels whose errors, (n,), these are."""
        return float(errors.mean(dtype=np.float64))

    def measure(self, reference_XYZ: Rows, test_XYZ: Rows, viewing: ViewingConditions) -> EyeMeasured:
        """Return the value of the whole map, and the map."""
        errors = self.error_map(reference_XYZ, test_XYZ, viewing)
        return EyeMeasured(self.pooled(errors.ravel()), errors)
