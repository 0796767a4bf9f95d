from .effects import factor_effects as factor_effects
from .figure import drawn_rows as drawn_rows
from .figure import effects_svg as effects_svg
from .report import explained_words as explained_words
from .report import factors_section as factors_section
from .result import FactorEffects as FactorEffects
from .values import session_factors as session_factors
