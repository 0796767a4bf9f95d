from .effects import factor_effects as factor_effects
from .figure import drawn_rows as drawn_rows
from .figure import effects_svg as effects_svg
from .result import FactorEffects as FactorEffects
from .values import session_factors as session_factors
