from .blocks import NAMES as NAMES
from .blocks import Proof as Proof
from .blocks import prove_block as prove_block
from .instruments import prove_instrument as prove_instrument
from .measures import prove_measure as prove_measure
from .promises import BrokenPromiseError as BrokenPromiseError
from .readers import prove_reader as prove_reader
from .recipes import prove_recipe as prove_recipe
