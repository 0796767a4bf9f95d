"""Plan how many observers to ask: simulate the study with several numbers of them.

python examples/plan_observers.py
"""

from pathlib import Path

import cyclopean

root = Path(__file__).parents[1]
study = cyclopean.power(
    root / "experiments/dynamic_range.yaml",
    [10, 20, 40, 80],
    scores=root / "configs/observers/table_4_4.yaml",
    replicates=100,
)
print(study)
print(study.to_frame()[["observers", "class_recovery", "pairs_alike", "log10_width"]].round(3).to_string(index=False))
