from .json_values import json_fields as json_fields
from .terminal import plain_table as plain_table
from .terminal import print_table as print_table
from .words import counted as counted
from .words import did_you_mean as did_you_mean
from .words import nearest as nearest
from .words import visible as visible
