"""The JSON Schema of each kind of file that people write."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, get_args

if TYPE_CHECKING:
    from pydantic import BaseModel

FileKind = Literal["experiment", "rig", "display", "stimuli", "observers", "verification", "camera", "regions"]
KINDS: tuple[FileKind, ...] = get_args(FileKind)


def json_schema(kind: FileKind) -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a kind of file, for editors that check while one types.

    Every key has a description, which an editor shows.

    Parameters
    ----------
    kind
        One of `KINDS`.

    Returns
    -------
    dict
        The schema, ready for `json.dumps`.

    Examples
    --------
    >>> json_schema("experiment")["title"]
    'ExperimentSpec'
    """
    from documents.yaml import described_schema

    return {**described_schema(file_model(kind)), "$schema": "https://json-schema.org/draft/2020-12/schema"}


def file_model(kind: FileKind) -> type[BaseModel]:
    """Return the pydantic model of a kind of file; only what the kind needs is imported.

    Parameters
    ----------
    kind
        The kind of file, one of `KINDS`.

    Returns
    -------
    type of pydantic.BaseModel
        The model that checks a file of this kind.

    Examples
    --------
    >>> file_model("rig").__name__
    'RigSpec'
    """
    if kind == "experiment":
        from runner.protocol.experiment import ExperimentSpec

        return ExperimentSpec
    if kind == "rig":
        from devices.display import RigSpec

        return RigSpec
    if kind == "display":
        from devices.display import DisplaySpec

        return DisplaySpec
    if kind == "observers":
        from runner.observers.observer_file import ObserverFile

        return ObserverFile
    if kind == "camera":
        from devices.camera import CameraSpec

        return CameraSpec
    if kind == "regions":
        from stimuli.comparison import RegionsSpec

        return RegionsSpec
    if kind == "verification":
        from devices.display import VerificationSpec

        return VerificationSpec
    from stimuli.recipes import Recipe

    return Recipe
