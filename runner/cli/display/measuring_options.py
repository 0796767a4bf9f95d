"""The panel that is typed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from devices.display import PanelSpec


def panel_of(text: str) -> PanelSpec:
    """Return the panel that ``--panel`` states, such as ``1920x1080,0.2768,120,8``."""
    from devices.display import PanelSpec

    try:
        return PanelSpec.parse(text)
    except ValueError:
        raise click.UsageError(f"--panel is '{text}'; write it as 1920x1080,0.2768,120,8") from None
