"""Commands that a test runs in its own process."""

from __future__ import annotations

import json
from typing import Any

from click.testing import CliRunner, Result

from runner.cli.main import group


def invoked(*words: object, text: str | None = None) -> Result:
    """Run a command on ``words``, with ``text`` as its standard input."""
    return CliRunner().invoke(group, [str(word) for word in words], input=text)


def printed(*words: object, text: str | None = None) -> str:
    """Return what a command prints, which must do its work; what it raises is raised."""
    result = invoked(*words, text=text)
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.stdout


def printed_json(*words: object) -> Any:
    """Return what a command prints as JSON."""
    return json.loads(printed(*words, "--json"))
