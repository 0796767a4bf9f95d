from .load import KIND_BY_KEY as KIND_BY_KEY
from .load import Strict as Strict
from .load import checked as checked
from .load import load_document as load_document
from .source import Path_ as Path_
from .source import YamlSource as YamlSource
from .source import parse_yaml as parse_yaml
from .source import read_yaml as read_yaml
