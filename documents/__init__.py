"""Files: reading what people write, where each value stands and what is wrong with it; writing whole or not at all."""

from documents.findings import Finding, InputError
from documents.yaml.load import load_document

__all__ = ["Finding", "InputError", "load_document"]
