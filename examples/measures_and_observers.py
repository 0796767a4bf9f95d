"""Which measure of pictures sees what observers see? Blur steps of a sparkling plate, and simulated observers.

python examples/measures_and_observers.py

Twelve simulated observers compare a plate with five blurred copies of it, whose scores fall with the blur: a measure of
blur agrees with them by construction.
"""

from pathlib import Path
from tempfile import mkdtemp

import numpy as np
from scipy.ndimage import gaussian_filter

from extensions.agreement import AgreementOptions, compare_with_observers
from runner.session import simulate
from stimuli.pictures import StereoImage, write_exr

root = Path(__file__).parents[1]
folder = Path(mkdtemp())
blurs_px = [0, 0.4, 0.7, 1.0, 1.5, 2.5]

random = np.random.default_rng(2016)
plate = 4 + gaussian_filter(random.normal(size=(80, 120)), 3) + 12 * (random.random((80, 120)) < 0.02)
recipe, scores = ["schema_version: 1", "kind: pictures", "stimuli:"], ["schema_version: 1", "kind: bradley_terry"]
scores.append("stimuli:")
for blur_px in blurs_px:
    light = np.maximum(gaussian_filter(plate, blur_px), 0.1)[..., None] * [0.95, 1.0, 1.09]
    left = light.astype(np.float32)
    write_exr(folder / f"blur-{blur_px}.exr", StereoImage(left, np.roll(left, 2, axis=1)))
    recipe.append(f"  - {{name: blur-{blur_px}, file: blur-{blur_px}.exr, factors: {{blur_px: {blur_px}}}}}")
    scores.append(f"  blur-{blur_px}: {{score: {np.exp(-2 * blur_px):.4f}}}")
(folder / "recipe.yaml").write_text("\n".join(recipe), encoding="utf-8")
(folder / "observers.yaml").write_text("\n".join(scores), encoding="utf-8")
experiment = folder / "blur.yaml"
experiment.write_text(
    f"""schema_version: 1
name: blur
rig: {(root / "configs/rigs/asus_vg248qe_3dvision.yaml").as_posix()}
stimuli: recipe.yaml
question: Which image is closer to the sharp one?
layout: {{arrangement: vertical, size_mm: [32, 21]}}
blocks:
  - {{kind: all_pairs, stimuli: all}}
""",
    encoding="utf-8",
)

simulate(experiment, folder / "observers.yaml", 12, results=folder / "results")
options = AgreementOptions(photographs=("blur-0",), experiment=experiment, page=folder / "agreement.html")
found = compare_with_observers([folder / "results"], ["delta-e-2000", "s-cielab"], options).agreement
for result in found.measures:
    rho = result.whole.correlations["spearman"]
    print(f"{result.predicted.title}: ρ = {rho.value:.2f} ({rho.low:.2f} to {rho.high:.2f}), {result.decision}")
    print(f"  {result.whole.accuracy.right:g} of {result.whole.accuracy.of} pairs that observers tell apart in order")
print(f"The page: {folder / 'agreement.html'}")
