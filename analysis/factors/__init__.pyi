from .effects import factor_effects as factor_effects
from .figure import drawn_rows as drawn_rows
from .figure import effects_svg as effects_svg
