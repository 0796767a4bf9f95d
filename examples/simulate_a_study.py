"""Run a whole study without a person: build the stimuli, let simulated observers answer, score, write the report.

    python examples/simulate_a_study.py [FOLDER]

The observers answer by the scores that the thesis published (Table 4.4).
"""

import sys
from pathlib import Path
from tempfile import mkdtemp

import cyclopean

root = Path(__file__).parents[1]
folder = Path(sys.argv[1] if len(sys.argv) > 1 else mkdtemp(prefix="cyclopean-"))

cyclopean.simulate(
    root / "experiments/dynamic_range.yaml", root / "configs/observers/table_4_4.yaml", folder, observers=10
)
trials = cyclopean.read_results(folder)
print(f"{len(trials)} trials by {trials['observer'].nunique()} observers")
print(trials.groupby("observer")["response_time_s"].median().round(2).to_string())

scores = cyclopean.scores(trials, method="firth")
print(scores.to_frame()[["name", "wins", "score", "class"]].round(3).to_string(index=False))
print(f"report: {cyclopean.report(folder, output=folder / 'report.html')}")
