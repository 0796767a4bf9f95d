from .observer_file import KINDS as KINDS
