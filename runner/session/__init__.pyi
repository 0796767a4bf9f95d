from .options import SessionOptions as SessionOptions
from .run import run_session as run_session
from .run import simulate as simulate
from .sealing import seal_results as seal_results
