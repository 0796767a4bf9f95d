"""Score a table of comparisons: scores, standard errors and perceptual classes.

    python examples/score_a_table.py

Each line says how often the winner was chosen over the loser. Any tool can write such a table; `cyclopean.scores` takes
it as a DataFrame or as a CSV file.
"""

import pandas as pd

import cyclopean

answers = pd.DataFrame(
    [
        ("matte", "gloss", 21),
        ("gloss", "matte", 9),
        ("matte", "sparkle", 26),
        ("sparkle", "matte", 4),
        ("gloss", "sparkle", 18),
        ("sparkle", "gloss", 12),
    ],
    columns=["winner", "loser", "count"],
)

scores = cyclopean.scores(answers)
table = scores.to_frame()[["name", "wins", "comparisons", "score", "log10_score", "class"]]
print(scores)
print(table.round(3).to_string(index=False))
