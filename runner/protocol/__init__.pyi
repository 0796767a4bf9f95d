from .experiment import Experiment as Experiment
from .experiment import read_experiment as read_experiment
from .schemas import FileKind as FileKind
from .schemas import file_model as file_model
from .schemas import json_schema as json_schema
