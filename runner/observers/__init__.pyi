from .observer_file import KINDS as KINDS
from .observer_file import read_observer as read_observer
from .presses import Person as Person
from .simulated import BradleyTerryObserver as BradleyTerryObserver
