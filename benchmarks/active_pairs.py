"""How fast scores come out of paired comparisons: pairs chosen by the answers so far beside random ones, in one run.

    python benchmarks/active_pairs.py [TIMES]

TIMES times as many sets of items are simulated; the figures in docs are by 3, which takes about ten minutes.

Simulated observers answer by the Bradley-Terry law; their true strengths are normal with a spread of 0.5 to 3 nats.
The same observers are asked random pairs, and pairs that `extensions.adaptive_pairs` chooses by either gain. Errors
are root mean squares of θ (nats, mean 0) of three estimates: the posterior under a learnt prior, as a report has it;
the plain method, the mode at the fixed point of [MacKay1992] with the curvature's covariance; and the fit without a
prior (by maximum likelihood, Firth's where items are separated, none where they are not linked). Coverage is that of
95 % intervals of all differences. The answers of ten observers of few trials each are pooled too, as a lab would; and
fifteen observers are asked pairs that are chosen by the answers of all of them, beside
a balanced design of as many trials (`runner.blocks.incomplete_pairs`): that is what is promised. ASAP's authors state
28 to 35 ms for each choice; it is not run here.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Mapping
from itertools import combinations
from pathlib import Path
from time import perf_counter

import numpy as np
from curves import is_quick, json_document, numbers, out, save, sized
from promises import Promise

from analysis.covariance import contrast_variances
from analysis.scaling.counts import Counts
from analysis.scaling.fitting import fit
from analysis.scaling.laws import LOGISTIC
from analysis.scaling.learnt_prior import learnt_posterior
from analysis.scaling.newton import joint_covariance, maximise
from analysis.scaling.penalty import Gaussian
from documents.arrays import Floats
from extensions.adaptive_pairs import PairChooser, pooled_study
from runner.blocks.incomplete_pairs import designs

Row = dict[str, object]
Answer = Callable[[int, int], bool]

TITLE = "Pairs chosen by the answers so far: error against trials"
SPREADS = sized((0.5, 1.0, 2.0, 3.0), (1.0,))
TRIALS_PER_STIMULUS = sized((5, 10, 30), (5, 10))
SEEDS: Mapping[int, int] = sized({10: 10, 20: 6, 60: 2}, {6: 2})
POOLED_SEEDS = 2
POOLED_OBSERVERS, POOLED_TRIALS_PER_STIMULUS = sized(10, 2), sized(10, 4)
SHARED_STIMULI, SHARED_OBSERVERS, SHARED_SPREAD_NATS = sized(60, 6), sized(15, 2), 2.0
SHARED_STUDIES = sized(4, 2)  # times TIMES
ASAP_S = 0.028  # the least that its authors state for one choice
_SPAN = 1.959963984540054  # half of a 95 % interval, in standard deviations
_TICKS_NATS = (0.3, 0.5, 1.0, 2.0)
_COLUMNS = {
    "rms_fixed_point": "{:.3f}",
    "rms_published": "{:.3f}",
    "coverage_learnt": "{:.1%}",
    "coverage_fixed_point": "{:.1%}",
    "sd_learnt": "{:.2f}",
    "sd_fixed_point": "{:.2f}",
    "kendall_tau": "{:.3f}",
    "ms_per_choice": "{:.2f} ms",
    "ms_learnt": "{:.0f} ms",
}
WAYS = ("random", "variance", "entropy")


def run(times: int = 1, seeds: Mapping[int, int] = SEEDS, spreads: tuple[float, ...] = SPREADS) -> list[Row]:
    """Measure and return the rows; ``seeds`` says how many sets of items there are of each size, ``times`` over."""
    rows: list[Row] = []
    for count, sets in seeds.items():
        for spread in spreads:
            rows += _alone(count, spread, sets * times)
    for spread in spreads:
        rows += _pooled(max(seeds), spread, POOLED_SEEDS * times)
    rows.append(_shared(SHARED_STUDIES * times))
    return rows


def promised(rows: list[Row]) -> list[Promise]:
    """Return what is promised of pairs that are chosen by the answers of all observers, the last of ``rows``."""
    shared = rows[-1]
    error, choice_s = float(str(shared["expected_times_balanced"])), float(str(shared["ms_per_choice"])) / 1000
    return [
        Promise("error expected of pooled active pairs to that of a balanced design", error, 0.8, "share", unit="×"),
        Promise("time of a pooled choice (ASAP states 0.028 to 0.035 s)", choice_s, ASAP_S, "seconds", unit="s"),
    ]


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


def covered(theta: Floats, found: Floats, covariance: Floats) -> float:
    """Return the share of differences that their 95 % intervals contain."""
    first, second = np.triu_indices(len(theta), 1)
    off = np.abs(found[first] - found[second] - theta[first] + theta[second])
    return float((off < _SPAN * np.sqrt(contrast_variances(covariance)[first, second])).mean())


def fixed_point(wins: Floats) -> tuple[Floats, Floats, float]:
    """Return mode, covariance and σ by the plain method: σ² is Σ θ² over the number of strengths that are determined.

    As if one more strength of 1.5 nats had been seen, which keeps σ above zero.
    """
    counts, sd, start = Counts.from_wins(wins[None]), 1.5, None
    for _ in range(500):
        penalty = Gaussian.of_sd(sd)
        top = maximise(counts, penalty=penalty, start=start)
        covariance, start = joint_covariance(counts, LOGISTIC, top.point, penalty)[0], top.theta
        determined = counts.n - np.trace(covariance) / sd**2
        sd, last = float(np.sqrt(((start**2).sum() + 1.5**2) / determined)), sd
        if abs(sd / last - 1) < 1e-4:
            break
    return start[0], covariance, sd


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
        learnt, plain, published, tau, cover, plain_cover, sds, plain_sds, fit_s = np.zeros((9, seeds, len(stops)))
        total_s = 0.0
        for seed in range(seeds):
            theta, answer = observer(count, spread, seed)
            for done, wins, spent_s in ask(way, count, stops[-1], seed, answer):
                if done == stops[-1]:
                    total_s += spent_s
                if done in stops:
                    at = seed, stops.index(done)
                    start_s = perf_counter()
                    found = learnt_posterior(wins)
                    fit_s[at] = perf_counter() - start_s
                    mode, covariance, plain_sds[at] = fixed_point(wins)
                    learnt[at], plain[at] = rms_error(found.theta, theta), rms_error(mode, theta)
                    cover[at], plain_cover[at] = (
                        covered(theta, found.theta, found.covariance),
                        covered(theta, mode, covariance),
                    )
                    published[at], sds[at] = rms_error(_published(wins), theta), found.prior_sd
                    tau[at] = kendalltau(found.theta, theta).statistic
        for stop, trials in enumerate(stops):
            rows.append(
                {
                    "series": f"n = {count}, spread {spread:g}: {way}",
                    "trials": trials,
                    "rms_learnt": _rms(learnt[:, stop]),
                    "rms_learnt_standard_error": float(learnt[:, stop].std(ddof=1) / np.sqrt(seeds)),
                    "rms_fixed_point": _rms(plain[:, stop]),
                    "rms_published": _rms_or_none(published[:, stop]),
                    "coverage_learnt": float(cover[:, stop].mean()),
                    "coverage_learnt_standard_error": float(cover[:, stop].std(ddof=1) / np.sqrt(seeds)),
                    "coverage_fixed_point": float(plain_cover[:, stop].mean()),
                    "sd_learnt": float(np.median(sds[:, stop])),
                    "smallest_sd_learnt": float(sds[:, stop].min()),
                    "sd_fixed_point": float(np.median(plain_sds[:, stop])),
                    "kendall_tau": float(tau[:, stop].mean()),
                    "ms_per_choice": 1000 * total_s / seeds / stops[-1],
                    "ms_learnt": 1000 * float(np.median(fit_s[:, stop])),
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


def expected_error(theta: Floats, asked: Floats) -> float:
    """Return the root mean square error of scores that answers to ``asked`` (n, n) pairs let expect.

    By the information in the answers and a prior as wide as the scores ``theta`` (n,) are spread: an error without the
    scatter of one study's answers.
    """
    return float(np.sqrt(np.trace(_expected_covariance(theta, asked)) / len(theta)))


def _expected_covariance(theta: Floats, asked: Floats) -> Floats:
    """Return the covariance (n, n) of the scores about their mean."""
    n = len(theta)
    right = 1 / (1 + np.exp(theta[None, :] - theta[:, None]))
    weight = asked * right * (1 - right)
    centred = np.eye(n) - 1 / n
    return centred @ np.linalg.inv(np.diag(weight.sum(axis=1)) - weight + np.eye(n) / theta.var()) @ centred


def best_design(theta: Floats, answers: int) -> Floats:
    """Return how often each pair (n, n) is asked by the design that makes `expected_error` least.

    Nobody has it: it needs the scores ``theta`` (n,) beforehand. By the multiplicative algorithm for optimal designs.
    """
    first, second = np.triu_indices(len(theta), 1)
    right = 1 / (1 + np.exp(theta[second] - theta[first]))
    times = np.full(len(first), answers / len(first))
    asked = np.zeros((len(theta), len(theta)))
    for _ in range(400):
        asked[first, second] = asked[second, first] = times
        squared = np.linalg.matrix_power(_expected_covariance(theta, asked), 2)
        reach = squared[first, first] + squared[second, second] - 2 * squared[first, second]
        times = times * np.sqrt(right * (1 - right) * reach.clip(0))
        times *= answers / times.sum()
    asked[first, second] = asked[second, first] = times
    return asked


def _shared(studies: int) -> Row:
    """Compare pairs chosen by the answers of all observers with a balanced design of as many trials."""
    count, trials = SHARED_STIMULI, SHARED_STIMULI * POOLED_TRIALS_PER_STIMULUS // 2
    every = list(combinations(range(count), 2))
    errors, expected, taken_s = np.zeros((studies, 2)), np.zeros((studies, 3)), 0.0
    for study in range(studies):
        theta, answer = observer(count, SHARED_SPREAD_NATS, study, 999)
        start_s = perf_counter()
        wins = pooled_study(np.tile(theta, (SHARED_OBSERVERS, 1)), trials, seed=str(study)).sum(axis=0)
        taken_s += perf_counter() - start_s
        balanced = np.zeros((count, count))
        for part in designs(count, every, min(trials, len(every)), str(study), SHARED_OBSERVERS):
            for i, j in (every[index] for index in part):
                balanced[(i, j) if answer(i, j) else (j, i)] += 1
        errors[study] = (
            rms_error(learnt_posterior(wins).theta, theta),
            rms_error(learnt_posterior(balanced).theta, theta),
        )
        answers = trials * SHARED_OBSERVERS
        expected[study] = [
            expected_error(theta, asked)
            for asked in (wins + wins.T, balanced + balanced.T, best_design(theta, answers))
        ]
    pooled, plain = _rms(errors[:, 0]), _rms(errors[:, 1])
    chosen, shared_out, best = (_rms(column) for column in expected.T)
    return {
        "series": f"n = {count}, spread {SHARED_SPREAD_NATS:g}: chosen by the answers of {SHARED_OBSERVERS} observers",
        "trials": trials * SHARED_OBSERVERS,
        "rms_learnt": pooled,
        "rms_learnt_standard_error": float(errors[:, 0].std(ddof=1) / np.sqrt(studies)),
        "rms_balanced": plain,
        "times_balanced": pooled / plain,
        "expected_times_balanced": chosen / shared_out,
        "expected_times_balanced_of_the_best_design": best / shared_out,
        "kendall_tau": None,
        "ms_per_choice": 1000 * taken_s / studies / trials / SHARED_OBSERVERS,
        "seeds": studies,
    }


def _rms(errors: Floats) -> float:
    return float(np.sqrt((errors**2).mean()))


def _rms_or_none(errors: Floats) -> float | None:
    """Return the root mean square, None where any of them has no number."""
    return None if np.isnan(errors).any() else _rms(errors)


def write(rows: list[Row], taken_s: float) -> None:
    """Write ``active_pairs.json``, ``.md`` and ``.svg``."""
    lines = [
        f"# {TITLE}",
        "",
        "Errors in nats; σ is the prior's standard deviation (median); the plain method is MacKay's fixed point.",
        "",
        "| series | trials | error | plain | no prior | coverage | plain | σ | plain | Kendall τ | a choice | fit |",
        "|---|" + "---:|" * 11,
    ]
    for row in rows:
        cells = [str(row["series"]), str(row["trials"])]
        cells.append(f"{row['rms_learnt']:.3f} ± {row['rms_learnt_standard_error']:.3f}")
        for key, form in _COLUMNS.items():
            cells.append("–" if row.get(key) is None else form.format(row[key]))
        lines.append(f"| {' | '.join(cells)} |")
    result = {"title": TITLE, "rows": rows, "promises": promised(rows)}
    save(
        "active_pairs",
        json_document("active_pairs", [result], taken_s=taken_s),
        "\n".join(lines) + "\n",
    )
    if not is_quick():
        _plot(rows, out() / "active_pairs.svg")


def _plot(rows: list[Row], file: Path) -> None:
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    alone = [row for row in rows if row["kendall_tau"] is not None]
    panels = list(dict.fromkeys(str(row["series"]).split(":")[0] for row in alone))[-len(SPREADS) :]  # the most items
    across = min(2, len(panels))
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
            axes.set_ylim(0.18, 2.8)
            axes.grid(True, which="both", alpha=0.3)
        figure.axes[0].legend(frameon=False)
        figure.suptitle(TITLE)
        figure.savefig(file, format="svg", metadata={"Date": None})


def main() -> None:
    """Measure, write the three files, and print the table."""
    start_s = perf_counter()
    rows = run(*numbers())
    write(rows, perf_counter() - start_s)
    print((out() / "active_pairs.md").read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
