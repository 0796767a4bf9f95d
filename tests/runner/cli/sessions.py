"""Sessions in which every pair of four stimuli was compared twice, as logs of older versions have them."""

from __future__ import annotations

import json
import random
from itertools import combinations
from pathlib import Path
from typing import Any

NAMES = "abcd"


def write_session(results: Path, observer: str, *, simulated: bool = True) -> None:
    """Write a session of the experiment 'small' below ``results``."""
    rng = random.Random(observer if simulated else f"{observer}, a person")
    started = "2026-01-02T03:04:05Z"
    header: dict[str, Any] = {
        **{"record": "session", "experiment": "small", "observer": observer, "started_utc": started, "seed": 1},
        **{"session": f"s{observer}{'simulated' if simulated else ''}", "question": "Which?", "simulated": simulated},
        "stimuli": [{"name": name, "factors": {"size": place}} for place, name in enumerate(NAMES)],
        **{key: {} for key in ("analysis", "hashes", "software", "presentation")},
        "display": {"mode": "flat"},
    }
    lines = [header]
    for number, (one, other) in enumerate([*combinations(NAMES, 2)] * 2):
        chosen, rejected = (one, other) if rng.random() < 0.7 else (other, one)
        answer = {"first": one, "second": other, "answer": "first" if chosen == one else "second"}
        place = {"record": "trial", "block": 0, "trial": number, "kind": "all_pairs", "first_position": "top"}
        press = {"events": [["up" if chosen == one else "down", 1.0]], "response_time_s": 1.0, "utc": started}
        lines.append({**place, **press, **answer, "chosen": chosen, "rejected": rejected})
    folder = results / "small" / f"sub-{observer}" / f"ses-{header['session']}"
    folder.mkdir(parents=True)
    text = "".join(f"{json.dumps(line)}\n" for line in [*lines, {"record": "end"}])
    (folder / "session.jsonl").write_text(text, encoding="utf-8")
