"""Files that sessions were made with are only those in their folder, whatever the list of them says or links to."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from analysis.records import CONFIGURATION_LIST, kept_files


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights there")
def test_files_elsewhere_are_not_taken_along(tmp_path: Path) -> None:
    (tmp_path / "secret.yaml").write_text("a: 1\n")
    results = tmp_path / "results" / "views"
    folder = results / "configuration" / "0123456789abcdef"
    folder.mkdir(parents=True)
    (folder / "views.yaml").write_text("b: 2\n")
    (folder / "link.yaml").symlink_to(tmp_path / "secret.yaml")
    (folder / "up").symlink_to(tmp_path)
    secret = str(tmp_path / "secret.yaml")
    names = ["views.yaml", "link.yaml", "up/secret.yaml", "../../../../secret.yaml", secret, "a\0b", "", 3, "none.yaml"]
    (folder / CONFIGURATION_LIST).write_text(json.dumps({"files": names}))
    linked = results / "configuration" / "fedcba9876543210"
    linked.mkdir()
    (linked / CONFIGURATION_LIST).symlink_to(tmp_path / "secret.yaml")
    log = results / "sub-01" / "ses-1" / "session.jsonl"
    kept = {"configuration/0123456789abcdef/views.yaml", f"configuration/0123456789abcdef/{CONFIGURATION_LIST}"}
    assert set(kept_files(log)) == kept
