"""One form for what is concluded: estimate, interval, verdict, and how robust it is."""

from __future__ import annotations

from analysis.classes import Conclusion


def test_a_line_says_estimate_interval_verdict_and_how_robust() -> None:
    clear = Conclusion("a over b", "distinguished", 0.0004, True, 1.204, 0.5, -1.9, "JND", "", 0.973, "744 analyses")
    for part in (
        "1.20 JND",
        "0.50 to −1.90",
        "distinguished (p < 0.001 by observers)",
        "stands in 97 % of 744 analyses",
    ):
        assert part in clear.sentence
    assert clear.to_json()["verdict"] == "distinguished"
    weak = Conclusion("a over b", "not distinguished", 0.31, False, stands=0.17, others="384 analyses")
    assert "not distinguished (p = 0.310 if" in weak.sentence
    assert "stands in only 17 % of 384" in weak.sentence
    assert "95 %" not in weak.sentence
    alike = Conclusion("a over b", "equivalent", 0.01, True, 0.1, -0.2, 0.4, "JND", margin="0.5jnd")
    assert "equivalent within ± 0.5jnd" in alike.sentence
    assert "stands" not in alike.sentence
