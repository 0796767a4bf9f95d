"""A value of a YAML file that is of the kind that its key ``kind`` names, of those in a registry."""

from __future__ import annotations

from functools import cache
from typing import Any

from pydantic import BaseModel, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, PydanticKnownError, SchemaValidator, core_schema

from documents.extensions import ExtensionError, Registry

_KEY = "kind"


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
        if _KEY not in value:
            raise PydanticKnownError("union_tag_not_found", {"discriminator": f"'{_KEY}'"})
        tag = value[_KEY]
        try:
            kind = self._registry.get(tag) if isinstance(tag, str) else None
        except ExtensionError as error:
            finding = error.findings[0]
            context = {"message": finding.message, "remedy": finding.remedy}
            raise PydanticCustomError("extension", "{message}", context) from None
        if kind is None:
            tags = ", ".join(repr(name) for name in self._registry.own())
            context = {"discriminator": f"'{_KEY}'", "tag": str(tag), "expected_tags": tags}
            raise PydanticKnownError("union_tag_invalid", context)
        return _validator(kind, tag).validate_python(value)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        kinds = {name: _schema(self._registry[name]) for name in self._registry.names()}
        if self._within:  # a kind that holds others, itself among them
            kinds = {name: core_schema.definition_reference_schema(_ref(each)) for name, each in kinds.items()}
            return handler(core_schema.tagged_union_schema(kinds, discriminator=_KEY))
        self._within = True
        try:
            return handler(core_schema.tagged_union_schema(kinds, discriminator=_KEY))
        finally:
            self._within = False


@cache
def _validator(kind: type[BaseModel], tag: str) -> SchemaValidator:
    # As a union of one, so that the place of a fault names the kind, as in any union.
    return SchemaValidator(core_schema.tagged_union_schema({tag: _schema(kind)}, discriminator=_KEY))


def _schema(kind: type[BaseModel]) -> Any:
    kind.model_rebuild()  # models are built when they are first needed
    return kind.__pydantic_core_schema__


def _ref(schema: Any) -> str:
    inner = schema["schema"] if schema["type"] == "definitions" else schema
    ref: str = inner.get("ref") or inner["schema_ref"]
    return ref
