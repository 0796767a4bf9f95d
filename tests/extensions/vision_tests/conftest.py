"""The display on which vision tests are shown, and parallax measured back from two views."""

import numpy as np

from devices.display import DisplayModel, ToneCurve
from documents.arrays import Floats

PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])


def model(black: float = 0.02, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> DisplayModel:
    """Return a display of these primaries, each ``scale`` times as bright, and of one ``black`` in cd/m²."""
    curve = ToneCurve(gamma=2.2)
    return DisplayModel(np.array([black, black, 1.5 * black]), PRIMARIES * scale, (curve, curve, curve))


def shifted(rows: Floats, by_px: float) -> Floats:
    """Move rows to the right, by their Fourier transforms."""
    turned = np.fft.rfft(rows, axis=1) * np.exp(-2j * np.pi * np.fft.rfftfreq(rows.shape[1]) * by_px)
    return np.fft.irfft(turned, rows.shape[1], axis=1)


def measured_px(left: Floats, right: Floats, patch: slice, about_px: float) -> float:
    """Return how far right of the left eye's the right eye's columns ``patch`` are, by the phases of their transforms.

    Both are moved by half of the last estimate before each of a few steps, so that the window about the patch favours
    no answer in the end. Frequencies below a quarter of the samples' are weighed by their energy.
    """
    window = np.hanning(patch.stop - patch.start)
    frequency = np.fft.rfftfreq(len(window))
    use = (frequency > 0.02) & (frequency < 0.25)
    found_px = about_px
    for _ in range(5):
        views = shifted(left, found_px / 2)[:, patch], shifted(right, -found_px / 2)[:, patch]
        first, second = (np.fft.rfft((view - view.mean()) * window, axis=1) for view in views)
        cross = (first * np.conj(second)).sum(axis=0)[use]
        weight = np.abs(cross)
        slope = (weight * frequency[use] * np.angle(cross)).sum() / (weight * frequency[use] ** 2).sum()
        found_px += float(slope / (2 * np.pi))
    return found_px
