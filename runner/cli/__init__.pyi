from .options import PATH as PATH
from .options import command_of as command_of
from .options import takes as takes
from .output import Step as Step
from .output import gives as gives
from .output import say as say
from .output import show as show
from .output import tell as tell
