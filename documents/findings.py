"""What is wrong with an input: one finding per fault, one error per reading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from documents.text.words import visible

# Nobody reads more of one message; what files hold comes up in it.
_SHOWN = 600


@dataclass(frozen=True, slots=True)
class Finding:
    """One fault in something a person supplied.

    ``file`` is the path as the person gave it; ``line`` and ``column`` count from 1 and are None where
    a place has no meaning (a picture, a missing file). ``remedy`` says what would be right. ``path`` is the keys and
    indices that lead to the value in its file; ``code`` names the kind of fault for programs, such as
    ``extra_forbidden`` (of a key) or ``less_than`` (of a number), and may be empty. As text it is one line without
    hidden characters, and long messages are cut.
    """

    message: str
    file: str | None = None
    line: int | None = None
    column: int | None = None
    remedy: str | None = None
    path: tuple[str | int, ...] = ()
    code: str = ""

    def __str__(self) -> str:
        place = ":".join(str(part) for part in (self.file, self.line, self.column) if part is not None)
        message = shortened(self.message)
        text = f"{place}: {message}" if place else message
        return visible(f"{text} ({shortened(self.remedy)})" if self.remedy else text)


def shortened(text: str, most: int = _SHOWN) -> str:
    """Return a text of at most so many characters; where it is cut, an ellipsis says so."""
    return text if len(text) <= most else f"{text[: most - 1]}…"


class WorkError(RuntimeError):
    """The input was right but the work could not be done; exit status 1."""


class InputError(Exception):
    """Something a person supplied is wrong; carries every finding, in the order they stand in the file."""

    def __init__(self, findings: Finding | Sequence[Finding] | str) -> None:
        if isinstance(findings, str):
            findings = Finding(findings)
        if isinstance(findings, Finding):
            findings = (findings,)
        self.findings: tuple[Finding, ...] = tuple(findings)
        super().__init__("\n".join(str(finding) for finding in self.findings))
