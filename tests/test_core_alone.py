"""The core's tests without extensions: what needs one is skipped and says which; what fails otherwise fails."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
TESTS = {
    "test_needs.py": "def test_one():\n    import extensions.gone\n\ndef test_wrong():\n    assert not 1\n",
    "test_imports.py": "import extensions.gone\n\ndef test_one():\n    pass\n",
}


def test_only_what_needs_an_extension_is_skipped(tmp_path: Path) -> None:
    for name, text in TESTS.items():
        (tmp_path / name).write_text(text)
    words = [
        "-q",
        "-rsf",
        "-p",
        "tools.core_alone",
        "-p",
        "no:cacheprovider",
        "--rootdir",
        str(tmp_path),
        str(tmp_path),
    ]
    command = [sys.executable, "-m", "pytest", *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "1 failed, 2 skipped" in done.stdout
    assert "test_needs.py::test_wrong" in done.stdout
    assert done.stdout.count("extensions.gone") == 1
    assert "it imports extensions/" in done.stdout
