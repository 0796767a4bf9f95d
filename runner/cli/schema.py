"""`cyclopean schema`: the JSON Schema of each kind of file, for editors that check while you type."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from pydantic import BaseModel

KINDS = ("experiment", "rig", "display", "stimuli", "observers", "verification", "camera", "regions")


@click.command(short_help="Print the JSON Schema of a file that you write.")
@click.argument("kind", type=click.Choice(KINDS), default="experiment")
def command(kind: str) -> None:
    """Print the JSON Schema of a file that you write.

    Save it and name it in your editor's settings for YAML, and the editor completes keys and marks mistakes.
    """
    schema = _model(kind).model_json_schema()
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    click.echo(json.dumps(schema, indent=2, ensure_ascii=False))


def _model(kind: str) -> type[BaseModel]:
    if kind == "experiment":
        from runner.protocol.experiment import ExperimentSpec

        return ExperimentSpec
    if kind == "rig":
        from devices.display.rig_file import RigSpec

        return RigSpec
    if kind == "display":
        from devices.display.display_file import DisplaySpec

        return DisplaySpec
    if kind == "observers":
        from runner.observers.observer_file import ObserverFile

        return ObserverFile
    if kind == "camera":
        from devices.camera.camera_file import CameraSpec

        return CameraSpec
    if kind == "regions":
        from stimuli.comparison.regions_file import RegionsSpec

        return RegionsSpec
    if kind == "verification":
        from devices.display.verification_file import VerificationSpec

        return VerificationSpec
    from stimuli.recipes.recipe import Recipe

    return Recipe
