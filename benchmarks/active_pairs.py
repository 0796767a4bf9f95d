"""How fast scores come out of paired comparisons: pairs chosen by the answers so far beside random ones, in one run.

    python benchmarks/active_pairs.py

Simulated observers answer by the Bradley-Terry law; their true strengths are normal with a spread of 1, 2 or 3 nats.
The same observers are asked random pairs, and pairs that `runner.blocks.pair_choice` chooses by either gain. Errors are
root mean squares of θ (nats, mean 0), once of the strengths under a learnt prior, and once of the fit that a report
publishes (by maximum likelihood, Firth's where items are separated, none where they are not linked). The answers of ten
observers of few trials each are pooled too, as a lab would.
"""

from __future__ import annotations

import json
import platform
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from time import perf_counter

import numpy as np
from curves import OUT
from numpy.typing import NDArray

from analysis.scaling.fitting import fit
from analysis.scaling.learnt_prior import learnt_posterior
from runner.blocks.pair_choice import PairChooser

Floats = NDArray[np.float64]
Row = dict[str, object]
Answer = Callable[[int, int], bool]

TITLE = "Pairs chosen by the answers so far: error against trials"
COUNTS = (30, 60)
SPREADS = (1.0, 2.0, 3.0)
TRIALS_PER_STIMULUS = (4, 10, 20, 40)
SEEDS = 16
POOLED_OBSERVERS, POOLED_TRIALS_PER_STIMULUS = 10, 10
_TICKS_NATS = (0.3, 0.5, 1.0, 2.0)
WAYS = ("random", "variance", "entropy")


def run(seeds: int = SEEDS, counts: tuple[int, ...] = COUNTS, spreads: tuple[float, ...] = SPREADS) -> list[Row]:
    """Measure and return the rows."""
    rows: list[Row] = []
    for count in counts:
        for spread in spreads:
            rows += _alone(count, spread, seeds)
            rows += _pooled(count, spread, max(4, seeds // 3))
    return rows


def ask(way: str, count: int, trials: int, seed: int, answer: Answer) -> Iterator[tuple[int, Floats, float]]:
    """Ask ``trials`` pairs and yield, after each, how many there were, the wins so far and the seconds spent choosing.

    ``answer`` says whether the first of two items won.
    """
    chooser = PairChooser(count, count // 2, random.Random(seed), "entropy" if way == "entropy" else "variance")
    rng = np.random.default_rng(seed + 1_000_000)
    done, spent_s = 0, 0.0
    while done < trials:
        if way == "random":
            first = int(rng.integers(count))
            pairs = [(first, int(first + 1 + rng.integers(count - 1)) % count)]
        else:
            start_s = perf_counter()
            pairs = chooser.next_batch(trials - done)
            spent_s += perf_counter() - start_s
        for first, second in pairs:
            chooser.learn(first, second, first_share=float(answer(first, second)))
            done += 1
            yield done, chooser.wins, spent_s


def observer(count: int, spread: float, seed: int, sitting: int = 0) -> tuple[Floats, Answer]:
    """Return true strengths, which belong to the ``seed``, and someone who answers by them at a ``sitting``."""
    theta = np.random.default_rng([seed, count]).normal(0, spread, count)
    theta -= theta.mean()
    rng = np.random.default_rng([seed, count, 1 + sitting])
    return theta, lambda i, j: bool(rng.random() < 1 / (1 + np.exp(theta[j] - theta[i])))


def rms_error(found: Floats, theta: Floats) -> float:
    """Return the root mean square of what is left when both have mean 0."""
    return float(np.sqrt(((found - found.mean() - theta) ** 2).mean()))


def _published(wins: Floats) -> Floats:
    """Return the strengths as a report gives them."""
    fitted = fit(wins)
    if fitted.separated:
        fitted = fit(wins, method="firth")
    return fitted.theta


def _alone(count: int, spread: float, seeds: int) -> list[Row]:
    from scipy.stats import kendalltau

    stops = [count * per // 2 for per in TRIALS_PER_STIMULUS]
    rows: list[Row] = []
    for way in WAYS:
        learnt, published, tau = np.zeros((3, seeds, len(stops)))
        total_s = 0.0
        for seed in range(seeds):
            theta, answer = observer(count, spread, seed)
            for done, wins, spent_s in ask(way, count, stops[-1], seed, answer):
                if done == stops[-1]:
                    total_s += spent_s
                if done in stops:
                    at = seed, stops.index(done)
                    found = learnt_posterior(wins).theta
                    learnt[at], published[at] = rms_error(found, theta), rms_error(_published(wins), theta)
                    tau[at] = kendalltau(found, theta).statistic
        for stop, trials in enumerate(stops):
            rows.append(
                {
                    "series": f"n = {count}, spread {spread:g}: {way}",
                    "trials": trials,
                    "rms_learnt": _rms(learnt[:, stop]),
                    "rms_learnt_standard_error": float(learnt[:, stop].std(ddof=1) / np.sqrt(seeds)),
                    "rms_published": _rms_or_none(published[:, stop]),
                    "kendall_tau": float(tau[:, stop].mean()),
                    "ms_per_choice": 1000 * total_s / seeds / stops[-1],
                    "seeds": seeds,
                }
            )
    return rows


def _pooled(count: int, spread: float, seeds: int) -> list[Row]:
    rows: list[Row] = []
    trials = count * POOLED_TRIALS_PER_STIMULUS // 2
    for way in WAYS:
        errors = []
        for seed in range(seeds):
            pooled = np.zeros((count, count))
            for sitting in range(POOLED_OBSERVERS):
                theta, answer = observer(count, spread, seed, sitting)
                for done, wins, _ in ask(way, count, trials, 100 * seed + sitting, answer):
                    if done == trials:
                        pooled += wins
            errors.append((rms_error(learnt_posterior(pooled).theta, theta), rms_error(_published(pooled), theta)))
        learnt, published = np.array(errors).T
        rows.append(
            {
                "series": f"n = {count}, spread {spread:g}: {way}, {POOLED_OBSERVERS} observers pooled",
                "trials": trials * POOLED_OBSERVERS,
                "rms_learnt": _rms(learnt),
                "rms_learnt_standard_error": float(learnt.std(ddof=1) / np.sqrt(seeds)),
                "rms_published": _rms_or_none(published),
                "kendall_tau": None,
                "ms_per_choice": None,
                "seeds": seeds,
            }
        )
    return rows


def _rms(errors: Floats) -> float:
    return float(np.sqrt((errors**2).mean()))


def _rms_or_none(errors: Floats) -> float | None:
    """Return the root mean square, None where any of them has no number."""
    return None if np.isnan(errors).any() else _rms(errors)


def write(rows: list[Row], out: Path = OUT) -> None:
    """Write ``active_pairs.json``, ``.md`` and ``.svg``."""
    out.mkdir(parents=True, exist_ok=True)
    machine = f"{platform.machine()}, {platform.system()}, Python {platform.python_version()}"
    document = {"name": "active_pairs", "title": TITLE, "machine": machine, "rows": rows}
    (out / "active_pairs.json").write_text(json.dumps(document, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    lines = [f"# {TITLE}", "", "| series | trials | error, learnt prior | error, as published | Kendall τ | a choice |"]
    lines.append("|---|---:|---:|---:|---:|---:|")
    for row in rows:
        tau = "–" if row["kendall_tau"] is None else f"{row['kendall_tau']:.3f}"
        cost = "–" if row["ms_per_choice"] is None else f"{row['ms_per_choice']:.2f} ms"
        published = "–" if row["rms_published"] is None else f"{row['rms_published']:.3f}"
        learnt = f"{row['rms_learnt']:.3f} ± {row['rms_learnt_standard_error']:.3f}"
        lines.append(f"| {row['series']} | {row['trials']} | {learnt} | {published} | {tau} | {cost} |")
    (out / "active_pairs.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    _plot(rows, out / "active_pairs.svg")


def _plot(rows: list[Row], file: Path) -> None:
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    alone = [row for row in rows if row["kendall_tau"] is not None]
    panels = list(dict.fromkeys(str(row["series"]).split(":")[0] for row in alone))
    across = min(3, len(panels))
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "active_pairs", "font.size": 9}):
        figure = Figure(figsize=(9.5, 6), layout="constrained")
        for place, panel in enumerate(panels):
            axes = figure.add_subplot(-(-len(panels) // across), across, place + 1)
            for way, marker in zip(WAYS, "osD", strict=True):
                here = [row for row in alone if row["series"] == f"{panel}: {way}"]
                errors = [row["rms_learnt"] for row in here]
                axes.plot([row["trials"] for row in here], errors, marker=marker, label=way)
            axes.set(xscale="log", yscale="log", xlabel="trials", ylabel="error in θ (nats)", title=panel)
            axes.minorticks_off()
            ticks = [float(str(row["trials"])) for row in here]
            axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
            axes.set_yticks(_TICKS_NATS, [f"{tick:g}" for tick in _TICKS_NATS])
            axes.set_ylim(0.28, 2.8)
            axes.grid(True, which="both", alpha=0.3)
        figure.axes[0].legend(frameon=False)
        figure.suptitle(TITLE)
        figure.savefig(file, format="svg", metadata={"Date": None})


def main() -> None:
    """Measure, write the three files, and print the table."""
    write(run())
    print((OUT / "active_pairs.md").read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
