"""A blue car paint beside its match on two screens: what a thousand persons of 20 to 60 years see.

python examples/car_paint_beside_a_screen.py
"""

import numpy as np

from devices.colour_matching import colorimetric_observer
from extensions.colour_observers import ScreenSpectra, individual_observers, observer_metamerism

wavelengths_nm = np.arange(390.0, 781.0)


def bump(middle_nm: float, width_nm: float) -> np.ndarray:
    """Return a smooth bump over wavelength."""
    return np.exp(-(((wavelengths_nm - middle_nm) / width_nm) ** 2))


# A metallic blue: flakes reflect a little of everything, the pigment blue, and red again beyond 680 nm.
paint = 0.04 + 0.35 * bump(465, 45) + 0.25 / (1 + np.exp((690 - wavelengths_nm) / 10))
daylight = 1.0 - 0.0012 * (wavelengths_nm - 560)
screens = {
    "quantum dots or lasers": np.stack([bump(630, 15), bump(530, 15), bump(455, 12)]),
    "broad filters": np.stack([bump(615, 45), bump(540, 50), bump(460, 30)]),
}
persons = individual_observers(1000, field_deg=10, ages_years=(20, 60), seed=1)
for observer in ("CIE 1931 2", "CIE 2015 10"):
    for name, primaries in screens.items():
        found = observer_metamerism(
            {"paint": paint},
            daylight,
            wavelengths_nm,
            ScreenSpectra(wavelengths_nm, np.zeros(len(wavelengths_nm)), 0.01 * primaries),
            persons,
            matched_for=colorimetric_observer(observer),
        )
        seen = found.summary(0)
        print(
            f"{name:23} matched for {observer:11}: ΔE00 median {seen['median']:.2f}, "
            f"95 % below {seen['p95']:.2f}, worst {seen['worst']:.2f} ({seen['worst_observer']})"
        )
