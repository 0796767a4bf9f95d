from .build_context import DisplaySetup as DisplaySetup
from .recipe import Recipe as Recipe
from .recipe import faults_of_inputs as faults_of_inputs
from .recipe import read_recipe as read_recipe
from .recipe import unreadable as unreadable
