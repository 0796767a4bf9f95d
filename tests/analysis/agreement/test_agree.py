"""Measures beside observers who are known: what is said, and what is left out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from analysis.agreement import (
    ObservedGroup,
    Predicted,
    agree,
    agreement_blocks,
    write_agreement_csv,
    write_agreement_page,
)
from analysis.agreement.observed_means import of_means
from analysis.errors import ResultsError
from analysis.records import new_header
from documents.arrays import Floats
from documents.pages import Heading, Paragraph
from tests.kept import known
from tests.pages import policy_of

HEADER = new_header("plates <b>", "01", "s1", "2026-01-31T09:30:00Z", seed=1)


def rated(quality: Floats, name: str = "", observers: int = 12, seed: int = 1) -> ObservedGroup:
    """Return what observers gave whose ratings scatter by 0.5 about ``quality``; stimulus 0 is the photograph."""
    each = quality + np.random.default_rng(seed).normal(0, 0.5, (observers, len(quality)))
    names = [f"{name}photo", *(f"{name}{letter}" for letter in "abcdefgh"[: len(quality) - 1])]
    return of_means(name, "ratings", "points", names, each, np.ones_like(each), alpha=0.05, adjust="holm")


def measure(*values: Floats, name: str = "blur", better: str = "lower", limit: float | None = None) -> Predicted:
    return Predicted(name, name.title(), "px", better, values, limit)  # type: ignore[arg-type]


QUALITY = np.array([4.0, 3.9, 3.4, 2.5, 1.5, 0.5])
BLUR = np.array([0.0, 0.2, 0.8, 1.5, 2.4, 3.1])


def test_a_measure_that_agrees() -> None:
    found = agree([rated(QUALITY)], ["photo"], [measure(BLUR, limit=0.5)])
    (result,) = found.measures
    rho = result.whole.correlations["spearman"]
    assert result.decision == "agrees"
    assert rho.value == pytest.approx(1)
    assert rho.p == pytest.approx(1 / 120)  # of five stimuli: the photograph takes no part
    assert rho.low is not None
    assert rho.low > 0.5
    assert result.whole.accuracy.share == 1
    calibration = known(result.whole.calibration)
    assert calibration.table is not None
    # 0.1 points below the photograph are not seen, 0.6 are, by 12 observers who scatter by 0.5.
    assert (calibration.same, calibration.table.hits, calibration.table.false_alarms) == (1, 1, 0)
    assert calibration.best is not None
    assert 0.2 < calibration.best < 0.8


def test_noise_and_a_reversed_measure_do_not_agree() -> None:
    noise = np.array([0.0, 0.5, 0.1, 0.9, 0.2, 0.4])
    found = agree([rated(QUALITY)], ["photo"], [measure(noise, name="noise"), measure(-BLUR, name="reversed")])
    assert [result.decision for result in found.measures] == ["not shown", "not shown"]
    assert found.measures[1].adjusted_p == 1
    assert found.measures[1].whole.accuracy.share == 0


def test_many_measures_are_corrected_for() -> None:
    random = np.random.default_rng(5)
    group = rated(QUALITY)
    alone = agree([group], ["photo"], [measure(BLUR)]).measures[0].adjusted_p
    others = [measure(random.normal(size=6), name=f"noise {number}") for number in range(2)]
    together = agree([group], ["photo"], [measure(BLUR), *others]).measures[0].adjusted_p
    assert alone == pytest.approx(1 / 120)
    assert together == pytest.approx(3 / 120)


def test_a_measure_that_is_the_same_for_all() -> None:
    found = agree([rated(QUALITY)], ["photo"], [measure(np.zeros(6)), measure(BLUR, name="other")])
    assert found.measures[0].decision == "cannot be said"
    assert found.measures[0].whole.correlations["pearson"].value is None
    assert found.measures[1].adjusted_p == pytest.approx(1 / 120)  # what cannot be tested is not corrected for


def test_groups_have_results_of_their_own_and_one_over_all() -> None:
    groups = [rated(QUALITY, "church "), rated(QUALITY[:5], "beach ", seed=2)]
    found = agree(groups, ["church photo", "beach photo"], [measure(BLUR, BLUR[:5])])
    (result,) = found.measures
    each = [group.correlations["pearson"].value for group in result.groups]
    assert None not in each
    assert result.whole.correlations["pearson"].value == pytest.approx(np.mean(np.array(each, dtype=float)))
    mean = result.whole.correlations["spearman"]
    assert mean.p == pytest.approx(1 / (120 * 24))
    assert mean.low is not None
    assert mean.high is not None
    # Of two groups more is known than of one.
    assert mean.low > min(group.correlations["spearman"].low or 0.0 for group in result.groups) - 1e-9
    assert mean.high == pytest.approx(1)
    assert result.whole.accuracy.of == sum(group.accuracy.of for group in result.groups)


def test_every_pair_has_each_measure_s_prediction() -> None:
    group = rated(QUALITY)
    turned = np.array([0.0, 0.2, 1.5, 0.8, 2.4, 2.4])
    found = agree([group], ["photo"], [measure(BLUR), measure(turned, name="turned")])
    pairs = {(pair.better, pair.worse): pair for pair in found.pairs(0)}
    assert len(pairs) == 10  # of five stimuli
    assert all(pair.difference >= 0 and pair.predicted["blur"] == 1 for pair in pairs.values())
    assert (pairs["b", "c"].predicted["turned"], pairs["d", "e"].predicted["turned"]) == (-1, 0)
    apart = [pair for pair in pairs.values() if pair.told_apart]
    result = found.measures[1].whole.accuracy
    assert result.of == len(apart)
    assert result.right == sum((1 + pair.predicted["turned"]) / 2 for pair in apart)
    assert len(found.to_json()["groups"][0]["pairs"]) == 10


def test_a_small_group_is_left_out_with_a_note() -> None:
    groups = [rated(QUALITY, "church "), rated(QUALITY[:3], "beach ")]
    found = agree(groups, ["church photo", "beach photo"], [measure(BLUR, BLUR[:3])])
    assert [group.name for group in found.groups] == ["church "]
    assert any("'beach '" in note for note in found.notes)
    assert len(found.measures[0].predicted.values) == 1


def test_fewer_than_three_stimuli_are_refused() -> None:
    with pytest.raises(ResultsError, match="compared 2 stimuli"):
        agree([rated(QUALITY[:3])], ["photo"], [measure(BLUR[:3])])


def test_a_photograph_that_was_not_compared_gives_no_limit() -> None:
    group = rated(QUALITY).only("abcde")
    found = agree([group], ["photo"], [measure(BLUR[1:], limit=1.0)])
    assert found.measures[0].whole.calibration is None
    assert any("did not compare the photograph" in note for note in found.notes)
    assert found.to_json()["groups"][0]["stimuli"][0]["same_class_as_photograph"] is None


@pytest.mark.usefixtures("undrawn")
def test_the_terminal_the_page_and_the_tables(tmp_path: Path) -> None:
    quality = np.array([4.0, 3.9, 3.4, 2.5, 1.5, 0.5])
    groups = [rated(quality, "church <i>"), rated(quality, "beach ", seed=3)]
    blur = measure(BLUR, BLUR, limit=0.5)
    ratio = measure(*[np.array([np.inf, 50.0, 40, 30, 20, 10])] * 2, name="ratio", better="higher")
    found = agree(groups, ["church <i>photo", "beach photo"], [blur, ratio], notes=["Observers are <simulated>."])
    said = [block.text for block in agreement_blocks(found) if isinstance(block, Heading | Paragraph)]
    assert any("Blur agrees with observers" in text for text in said)
    assert any("Within the limit of 0.5 px" in text for text in said)
    write_agreement_page(found, HEADER, tmp_path / "page.html", (("Pictures", "<as shown>"),))
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert policy_of(page)
    assert page.count("<svg") == 8  # wide and narrow, of scores and limits, of two measures
    for text in ("plates &lt;b&gt;", "&lt;simulated&gt;", "&lt;as shown&gt;", "church &lt;i&gt;"):
        assert text in page
    for text in ("<simulated>", "<as shown>", "church <i>", "nan", "NaN"):
        assert text not in page
    files = write_agreement_csv(found, tmp_path / "tables")
    assert [file.name for file in files] == ["agreement.csv", "scores.csv", "pairs.csv", "limits.csv"]
    assert len((tmp_path / "tables/scores.csv").read_text(encoding="utf-8").splitlines()) == 13
