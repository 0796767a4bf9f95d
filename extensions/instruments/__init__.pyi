from .cs2000 import CS2000 as CS2000
from .photo_research import PhotoResearch as PhotoResearch
from .spotread import Spotread as Spotread
