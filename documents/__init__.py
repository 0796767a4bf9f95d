"""Reading the files that people write: where each value stands, and what is wrong with it."""

from documents.findings import Finding, InputError
from documents.load import load_document

__all__ = ["Finding", "InputError", "load_document"]
