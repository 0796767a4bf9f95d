"""What Methods say of the computation: models, intervals, random draws, p values, families of tests, effect sizes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from analysis.bootstrap.replicates import SEED as BOOTSTRAP_SEED
from analysis.classes.multiplicity import ADJUSTMENT_NAMES, MAXZ_SEED, maxz_draws
from analysis.inference.chances import PairProbabilities
from analysis.inference.conclusions import pair_conclusions
from analysis.inference.cross_validation import SEED as FOLDS_SEED
from analysis.inference.cross_validation import ModelComparison
from analysis.inference.fit_of_pairs import PairResiduals
from analysis.inference.tost import Equivalence
from analysis.inference.transitivity_tests import SEED as TRIPLES_SEED
from analysis.inference.transitivity_tests import Transitivity
from analysis.observers.concordance import SEED as SHUFFLES_SEED
from analysis.report.grouped import GroupedSummary
from analysis.report.part import draws_of_weights
from analysis.report.references import Citations
from analysis.report.reviewers import Review
from analysis.report.summary import ReportSummary, Summary
from analysis.report.words import counted, fixed, listed, percent
from analysis.scaling import learnt_prior
from analysis.scaling.robust_tests import FEWEST_OBSERVERS

if TYPE_CHECKING:
    from analysis.report.report import Report


def analysis_words(report: Report, cited: Citations) -> str:
    """Say by which models and rules the results and their intervals were computed."""
    compared = report.pairs or report.groups
    parts = [
        _compared(compared, ADJUSTMENT_NAMES[compared.adjust], cited) if compared else "",
        f"Circular triads and Kendall's u are those of {cited.cite('Kendall1940')}." if report.observers else "",
        *(part.analysis(cited) for part in report.all_parts),
    ]
    return " ".join(filter(None, parts)) or "No score, mean or threshold was computed."


def draws_words(report: Report, cited: Citations) -> str:
    """Say how many random draws were made for what, with which seed."""
    made = list(dict.fromkeys([*_draws_of_pairs(report), *(draw for part in report.parts for draw in part.draws)]))
    if not made:
        return "Nothing in the report was computed from random draws."
    return f"Random draws: {'; '.join(made)}. The seeds are fixed: the same answers give the same numbers."


def _scales(report: Report) -> list[Summary]:
    """Return the scores on each scale."""
    grouped = report.groups
    of_groups = [*(part for _, part in grouped.groups), grouped.pooled] if grouped else []
    return [scale for scale in (report.pairs, *of_groups) if scale is not None]


def _pairs_of(scale: Summary) -> int:
    """Return how many differences between two stimuli are tested."""
    return len(scale.scores.items) * (len(scale.scores.items) - 1) // 2


def _draws_of_pairs(report: Report) -> Iterator[str]:
    for scale in _scales(report):
        if scale.estimate.stability is not None:
            samples = f"{scale.estimate.stability.replicates:,} bootstrap samples of the observers"
            yield f"{samples} for the stability of the classes (seed {BOOTSTRAP_SEED})"
        if scale.estimate.method == "learnt_prior":
            draws, seed = learnt_prior.DRAWS, learnt_prior.SEED
            yield f"{draws:,} draws from the posterior for the intervals of scores (seed {seed})"
        if scale.scores.classes is not None and scale.adjust == "maxz":
            clustered = scale.scores.fit.clustered
            draws = maxz_draws(_pairs_of(scale), clustered=bool(clustered and clustered.spread))
            yield f"{draws:,} draws for the maximum of z (seed {MAXZ_SEED})"
    compared = report.pairs or report.groups
    if compared and _by_observers(report):
        yield draws_of_weights(len(compared.observers))
    for part in report.scale_parts:
        yield from part.draws
    concordance = report.observers.concordance if report.observers else None
    if concordance is not None and concordance.strangers_p is not None:
        yield (
            f"{concordance.shuffles:,} permutations for the test against unrelated preferences (seed {SHUFFLES_SEED})"
        )
    triples, models = report.review.get("transitivity"), report.review.get("model_comparison")
    if isinstance(triples, Transitivity):
        yield f"{triples.replicates:,} simulated studies of each kind for transitivity (seed {TRIPLES_SEED})"
    if isinstance(models, ModelComparison) and models.folds < models.observers:
        yield f"{models.folds} random folds of the observers for the comparison of models (seed {FOLDS_SEED})"


def _by_observers(report: Report) -> bool:
    """Whether a test of pairs has the observer as its unit, by a bootstrap."""
    of_parts = any(part.by_observers for part in report.scale_parts)
    return of_parts or any(scale.one_scale and scale.one_scale.by_observers for scale in _scales(report))


VERDICTS = (
    "Each question has one line: estimate, 95 % interval, and a verdict by one p value. A difference that is not "
    "significant is called not distinguished, which is no evidence of equality; only one that is significantly smaller "
    "than a margin is called equivalent. How robust a verdict is, is the share of other analyses of the same "
    "answers that conclude the same."
)


def p_words(report: Report, cited: Citations) -> str:
    """Say which p value is to be reported where a table has more than one, and of which kind the others are."""
    parts = [VERDICTS] if report.conclusions else []
    compared = report.pairs or report.groups
    if compared:
        corrected = "not corrected" if compared.adjust == "none" else "reported after the correction"
        parts.append(f"The p value of a difference between two stimuli is two-sided and {corrected}.")
    fits = [scale.one_scale for scale in _scales(report) if scale.one_scale]
    if any(fit.by_observers for fit in fits):
        parts.append("Whether one scale fits is judged by the p value by bootstrap over observers.")
    elif fits:
        parts.append(
            "Whether one scale fits is judged by the p value of the χ² distribution, which treats all answers as "
            f"independent, for there are fewer than {FEWEST_OBSERVERS} observers."
        )
    parts += [sentence for part in report.scale_parts for sentence in part.p_values]
    if report.observers and any(line.consistency and line.consistency.test for line in report.observers.lines):
        parts.append("The p value of circular triads is the mid-p value.")
    if isinstance(report.review.get("transitivity"), Transitivity):
        parts.append("Of the two p values of transitivity the larger one counts.")
    parts += [sentence for part in report.parts for sentence in part.p_values]
    return " ".join(parts) or "No p value is reported."


def correction_words(report: Report, cited: Citations) -> str:
    """Say which tests are a family, how many there are, and how they are corrected."""
    families = list(_families(report))
    if not families:
        return "No p value is corrected for the number of tests."
    whole = " Each family is corrected by itself." if len(families) > 1 else ""
    return f"Families of tests: {'; '.join(families)}.{whole}"


def _families(report: Report) -> Iterator[str]:
    grouped = report.groups
    scales = [("", report.pairs)] if report.pairs else []
    scales += [(f" of {name}", part) for name, part in grouped.groups] if grouped else []
    scales += [(" of all groups together", grouped.pooled)] if grouped and grouped.pooled else []
    for name, scale in scales:
        if scale is not None and scale.scores.classes is not None:
            tests = counted(_pairs_of(scale), "difference")
            yield f"{tests} between {len(scale.scores.items)} stimuli{name}, with {ADJUSTMENT_NAMES[scale.adjust]}"
    equivalent, residuals = report.review.get("equivalence"), report.review.get("residuals")
    if isinstance(equivalent, Equivalence):
        tests = counted(len(equivalent.pairs), "test")
        yield f"{tests} of equivalence, with {ADJUSTMENT_NAMES[equivalent.adjust]}"
    if isinstance(residuals, PairResiduals):
        yield f"the residuals of {counted(len(residuals.pairs), 'pair')}, with {ADJUSTMENT_NAMES[residuals.adjust]}"
    judged = [line for line in report.observers.lines if line.fit] if report.observers else []
    if judged:
        yield f"whether each of {counted(len(judged), 'observer')} is unlike the others, with {_HOLM}"
    for part in report.all_parts:
        yield from part.families


_HOLM = ADJUSTMENT_NAMES["holm"]


def effect_words(report: Report, cited: Citations) -> str:
    """Say which effect sizes are reported, with which intervals; of pairs also the largest."""
    parts = []
    if _scales(report):
        parts.append(
            "Effect sizes of stimuli are differences of log strength, in nats (one nat multiplies the odds of being "
            "preferred by 2.7)."
        )
    pairs = report.review.get("pairs")
    if report.pairs and isinstance(pairs, PairProbabilities) and pairs.pairs:
        parts.append(_largest(report.pairs, report.review, pairs))
    parts += [part.effects for part in report.all_parts if part.effects]
    return " ".join(parts) or "No effect size is reported."


def _largest(summary: Summary, review: Review, pairs: PairProbabilities) -> str:
    """Say how far apart the two most different stimuli are, in JND and as a share of choices."""
    found = zip(pairs.pairs, pair_conclusions(summary.scores, review, summary.estimate.stability), strict=True)
    pair, largest = max(found, key=lambda both: both[0].difference)
    chance = pair.first_preferred
    return (
        "Each is also given in JND and as the chance that one of the two is chosen, with a 95 % interval. The largest "
        f"is {largest.sentence} It is {percent(chance.value)} of choices ({percent(chance.low)} to "
        f"{percent(chance.high)})."
    )


def _compared(compared: Summary | GroupedSummary, adjustment: str, cited: Citations) -> str:
    if isinstance(compared, Summary):
        return _pairs(compared, compared, adjustment, cited)
    words = (
        f"Stimuli were compared within each of {len(compared.groups)} groups ({compared.factor}) only, and each group "
        f"has a scale of its own. {_pairs(compared.groups[0][1], compared, adjustment, cited)}"
    )
    firth = [name for name, part in compared.groups if part.estimate.method == "firth"]
    if firth and compared.groups[0][1].estimate.method != "firth":
        words += (
            f" In {listed(firth)}, where separation was complete, scores were fitted by Firth's penalised likelihood "
            f"{cited.cite('Firth1993')}."
        )
    if compared.pooled is not None:
        words += (
            " A pooled scale was fitted to all answers, with stimuli of different groups as one where their other "
            "factors agree"
        )
        test = compared.scored.agreement
        words += (
            "; whether it serves all groups was tested by a score test against a scale for each, its statistic "
            f"compared with the spread between observers {cited.cite('Dempster1958')}."
            if test is not None and test.p is not None
            else "."
        )
    return words


def _pairs(summary: Summary, whole: ReportSummary, adjustment: str, cited: Citations) -> str:
    estimate = summary.estimate
    model = f"the Bradley-Terry model {cited.cite('Bradley1952')}"
    fitted = {
        "ml": f"Scores are those of {model}, fitted by maximum likelihood.",
        "firth": f"Scores are those of {model}, fitted by Firth's penalised likelihood {cited.cite('Firth1993')}, "
        "because of complete separation."
        if estimate.method == "firth"
        else "",
        "learnt_prior": f"Scores are those of {model}: the posterior mean, by expectation propagation "
        f"{cited.cite('Minka2001')}, under a normal prior. The prior's standard deviation "
        f"({fixed(estimate.prior_sd, 2)} nats) was estimated from the answers, and its uncertainty is included "
        f"{cited.cite('Gelman2006')}. The reason is that pairs were chosen by earlier answers."
        if estimate.method == "learnt_prior"
        else "",
    }[estimate.method]
    parts = [fitted]
    parts.append(
        "95 % intervals are quantiles of that posterior"
        + (", scaled by how much observers differ." if estimate.covariance == "scaled" else ".")
        if estimate.method == "learnt_prior"
        else "95 % intervals follow by the delta method from the same covariance as the classes"
        + (", with Student's t." if estimate.covariance != "model" else ".")
    )
    if summary.scores.classes is not None:
        keys = {"shrinkage": ("Ledoit2004", "Bell2002"), "sandwich": ("White1982", "Bell2002")}
        works = (*(("Heinze2002",) if estimate.by_likelihood else ()), *keys.get(estimate.covariance, ()))
        errors = f"{estimate.error_words}{' ' + cited.cite(*works) if works else ''}"
        source = {"holm": ("Holm1979",), "bh": ("Benjamini1995",)}.get(summary.adjust, ())
        correction = f"{adjustment}{' ' + cited.cite(*source) if source else ''}"
        parts.append(
            f"Two stimuli share a perceptual class if their scores are not distinguished at level {summary.alpha:g}, "
            f"by {errors}, with {correction}; classes are a compact letter display {cited.cite('Piepho2004')}."
        )
    if whole is summary and summary.fit_p is not None and estimate.method == "ml":
        fit = summary.scores.fit
        fitted = f"The model's deviance is {fixed(fit.deviance, 1)} on {fit.df} degrees of freedom"
        if summary.one_scale is not None and summary.one_scale.by_observers:
            fitted += (
                "; whether one scale fits is tested by Pearson's statistic with a score bootstrap over observers "
                f"{cited.cite('Kline2012', 'Webb2023')}"
            )
        parts.append(f"{fitted}.")
    if whole.first_share is not None:
        wilson, kish = cited.cite("Wilson1927"), cited.cite("Kish1965")
        parts.append(f"Shares have Wilson's intervals {wilson}, for the effective number of answers {kish}.")
    return " ".join(parts)
