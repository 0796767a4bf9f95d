"""A finding at the place of what it is about."""

from __future__ import annotations

from documents import Finding
from documents.yaml.source import Path_, YamlSource


def finding_at(source: YamlSource, path: Path_, message: str, remedy: str | None = None) -> Finding:
    """Return a finding about what stands at ``path``."""
    place = source.place(path)
    return Finding(message, source.file, place.line if place else None, place.column if place else None, remedy)
