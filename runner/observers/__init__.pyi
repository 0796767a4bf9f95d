from .observer_file import KINDS as KINDS
from .observer_file import read_observer as read_observer
from .presses import Person as Person
from .simulated import BradleyTerryObserver as BradleyTerryObserver
from .simulated import key_for as key_for
from .simulated import plain_key as plain_key
from .simulated import walk as walk
