"""Measure a contrast threshold whole: gratings of ten contrasts, a block by QUEST+, three simulated observers, the fit.

python examples/contrast_threshold.py
"""

import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from analysis.records import read_results
from extensions.thresholds import summarise_thresholds
from runner.session import simulate
from stimuli.pictures import StereoImage, write_exr

CONTRASTS = {"blank": 0.0} | {f"grating-{n}": float(c) for n, c in enumerate(np.geomspace(0.005, 0.3, 10).round(4))}
rig = Path(__file__).parents[1] / "configs/rigs/asus_vg248qe_3dvision.yaml"
y, x = np.mgrid[-60:60, -90:90]
white = np.array([0.95, 1.0, 1.09])

with tempfile.TemporaryDirectory() as name:
    folder = Path(name)
    for stimulus, contrast in CONTRASTS.items():
        grating = 1 + contrast * np.exp(-(x**2 + y**2) / 1200) * np.sin(x / 3)
        write_exr(folder / f"{stimulus}.exr", StereoImage.flat((10 * grating[..., None] * white).astype(np.float32)))
    stimuli = [{"name": each, "file": f"{each}.exr", "factors": {"contrast": c}} for each, c in CONTRASTS.items()]
    block = {"kind": "threshold", "factor": "contrast", "task": "two_places", "reference": "blank", "trials": 100}
    files: dict[str, dict[str, Any]] = {
        "recipe": {"kind": "pictures", "stimuli": stimuli},
        "gratings": {
            "name": "gratings",
            "rig": str(rig),
            "stimuli": "recipe.yaml",
            "question": "Where is the grating?",
            "layout": {"arrangement": "vertical", "size_mm": [40, 25]},
            "blocks": [{**block, "function": "logistic"}],
        },
        "observers": {
            "kind": "bradley_terry",
            "psychometric": {"contrast": {"threshold": 0.03, "slope": 4}},
        },
    }
    for file, content in files.items():
        (folder / f"{file}.yaml").write_text(json.dumps({"schema_version": 1, **content}))
    simulate(folder / "gratings.yaml", folder / "observers.yaml", 3, results=folder / "results")
    (question,) = summarise_thresholds(read_results(folder / "results")).questions

for each in question.observers:
    threshold, interval = each.fit.threshold, each.fit.threshold_interval
    assert threshold is not None
    assert interval is not None
    print(f"observer {each.observer}: threshold {threshold:.3f}, 95 % {interval[0]:.3f} to {interval[1]:.3f}")
mean = question.threshold
print(f"{question.question.name}: mean {mean.value:.3f} of {mean.observers} observers, who see 0.03 by half")
