"""From a YAML file to a checked pydantic model, with every fault located."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, Generic, Literal, TypeVar

from pydantic import (
    BaseModel,
    ConfigDict,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    RootModel,
    ValidationError,
)
from pydantic_core import CoreSchema, PydanticCustomError, PydanticKnownError, SchemaValidator, core_schema

from documents.extensions import ExtensionError, Registry
from documents.findings import Finding, InputError
from documents.yaml.ranges import refuse_unranged
from documents.yaml.source import YamlSource, read_yaml
from documents.yaml.wording import file_findings

# Nobody reads more; a file of nothing but faults would take minutes to explain.
MOST_FINDINGS = 100

Model = TypeVar("Model", bound=BaseModel)
Kinds = TypeVar("Kinds")

Kind = Literal["experiment", "display", "verification", "camera", "regions", "rig", "recipe"]

_TAG = "kind"  # the key that says of which kind a value is
# The first key that is there decides.
KIND_BY_KEY = MappingProxyType(
    {
        "blocks": "experiment",
        "modes": "display",
        "nominal": "display",
        "onset_error_ms": "verification",
        "onsets": "verification",
        "matrix_XYZ_cd_m2": "camera",
        "regions": "regions",
        "mode": "rig",
        "kind": "recipe",
    }
)
_CALLED = MappingProxyType(
    {
        "experiment": "an experiment",
        "display": "a display file",
        "verification": "a photodiode's record",
        "camera": "a camera file",
        "regions": "a file of areas to compare",
        "rig": "a rig file",
        "recipe": "a recipe or observers file",
    }
)
# What only a file of the wanted kind has: with it, it is that kind, and has faults.
_OWN = MappingProxyType({"rig": ("display",), "recipe": ("kind",), "display": ("modes", "panel")})
_WANTED = MappingProxyType({**_CALLED, "recipe": "a recipe"})


class FileModel(BaseModel):
    """Base of every model of a YAML file: frozen; unknown keys, NaN and infinity are refused.

    A model with a number that has no range is refused too, when it is built.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        schema = handler(source)
        refuse_unranged(cls.__qualname__, schema)
        return schema


class OneOf(RootModel[Kinds], Generic[Kinds]):
    """Base of the model of a YAML file of several kinds: of ``Annotated[A | B, Field(discriminator="kind")]``."""

    model_config = ConfigDict(defer_build=True)


class ByKind:
    """Makes ``Annotated[Base, ByKind(REGISTRY)]`` the type of a value of any kind of ``REGISTRY``.

    It is as a union that pydantic discriminates by ``kind``, but a kind is loaded only when a value names it, so that
    a study loads no kind that it does not have, and other packages' kinds are as good as ours.
    """

    def __init__(self, registry: Registry[Any]) -> None:
        self._registry = registry
        self._within = False

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self._checked)

    def _checked(self, value: Any) -> Any:
        if isinstance(value, BaseModel):
            return value
        if not isinstance(value, dict):
            raise PydanticKnownError("model_attributes_type")
        if _TAG not in value:
            raise PydanticKnownError("union_tag_not_found", {"discriminator": f"'{_TAG}'"})
        tag = value[_TAG]
        try:
            kind = self._registry.get(tag) if isinstance(tag, str) else None
        except ExtensionError as error:
            finding = error.findings[0]
            context = {"message": finding.message, "remedy": finding.remedy}
            raise PydanticCustomError("extension", "{message}", context) from None
        if kind is None:
            tags = ", ".join(repr(name) for name in self._registry.own())
            context = {"discriminator": f"'{_TAG}'", "tag": str(tag), "expected_tags": tags}
            raise PydanticKnownError("union_tag_invalid", context)
        return _validator(kind, tag).validate_python(value)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        kinds = {name: _schema(self._registry[name]) for name in self._registry.names()}
        if self._within:  # a kind that holds others, itself among them
            kinds = {name: core_schema.definition_reference_schema(_ref(each)) for name, each in kinds.items()}
            return handler(core_schema.tagged_union_schema(kinds, discriminator=_TAG))
        self._within = True
        try:
            return handler(core_schema.tagged_union_schema(kinds, discriminator=_TAG))
        finally:
            self._within = False


@cache
def _validator(kind: type[BaseModel], tag: str) -> SchemaValidator:
    # As a union of one, so that the place of a fault names the kind, as in any union.
    return SchemaValidator(core_schema.tagged_union_schema({tag: _schema(kind)}, discriminator=_TAG))


def _schema(kind: type[BaseModel]) -> Any:
    kind.model_rebuild()  # models are built when they are first needed
    return kind.__pydantic_core_schema__


def _ref(schema: Any) -> str:
    inner = schema["schema"] if schema["type"] == "definitions" else schema
    ref: str = inner.get("ref") or inner["schema_ref"]
    return ref


def load_document(path: Path, model: type[Model], kind: Kind | None = None) -> tuple[Model, YamlSource]:
    """Read the YAML file at ``path`` as a ``model``, of the ``kind`` of files that is wanted.

    Returns the model and its source, so that later checks can still name lines.

    Parameters
    ----------
    path
        The file to read.
    model
        The pydantic model that its keys must satisfy.
    kind
        The kind of file that is wanted; None takes any.

    Returns
    -------
    tuple
        The model and its source, so that later checks can still name lines.

    Raises
    ------
    InputError
        With one finding per fault: file, line, column, key, value and the nearest valid spelling. A file of another
        kind is reported as that alone.

    Examples
    --------
    >>> class Note(FileModel):
    ...     text: str
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "note.yaml")
    ...     _ = file.write_text("text: bright")
    ...     load_document(file, Note)[0].text
    'bright'
    """
    source = read_yaml(path)
    try:
        return checked(source, model), source
    except InputError:
        if kind and (wrong := wrong_kind(source, kind)):
            raise InputError(wrong) from None
        raise


def checked(source: YamlSource, model: type[Model]) -> Model:
    """Return what has been read as a ``model``.

    Parameters
    ----------
    source
        What `parse_yaml` returns.
    model
        The pydantic model that its keys must satisfy.

    Returns
    -------
    Model
        The model.

    Raises
    ------
    InputError
        With one finding per fault: what stands where, and what to write instead.

    Examples
    --------
    >>> from devices.display import PanelSpec
    >>> from documents.yaml import parse_yaml
    >>> checked(parse_yaml("{resolution_px: [640, 480], pixel_pitch_mm: 7 cm}", "a.yaml"), PanelSpec)
    Traceback (most recent call last):
    ...
    documents.findings.InputError: a.yaml:1:45: 'pixel_pitch_mm' is '7 cm' (write the number alone: pixel_pitch_mm: 70)
    """
    try:
        return model.model_validate(source.data)
    except ValidationError as error:
        raise InputError(file_findings(error.errors(include_url=False), source, model, MOST_FINDINGS)) from None


def wrong_kind(source: YamlSource, wanted: Kind) -> Finding | None:
    """Return that a file is of another kind than ``wanted``, where its keys show that; else None."""
    data: Any = source.data
    if not isinstance(data, dict):
        return None
    own = _OWN.get(wanted) or tuple(key for key, kind in KIND_BY_KEY.items() if kind == wanted)
    key = next((key for key in KIND_BY_KEY if key in data), None)
    if key is None or KIND_BY_KEY[key] == wanted or any(name in data for name in own):
        return None
    what = f"this is {_CALLED[KIND_BY_KEY[key]]}, not {_WANTED[wanted]}"
    remedy = f"{_WANTED[wanted]} has '{own[0]}:'; check the path"
    return source.finding((key,), what, remedy, key=True)
