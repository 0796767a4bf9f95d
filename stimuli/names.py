"""What the stimuli of a recipe are called, known before any is built."""

from __future__ import annotations

from stimuli.recipe import PicturesRecipe, SparklePlateRecipe, View


def stimulus_name(name: str, view: View | None) -> str:
    """Return the name of the stimulus that shows ``name`` in ``view``, or as it is stored."""
    return f"{name}-{view}" if view else name


def stimulus_names(recipe: SparklePlateRecipe | PicturesRecipe) -> tuple[str, ...]:
    """Return the names of all stimuli that ``recipe`` makes, in its order."""
    return tuple(stimulus_name(one.name, view) for one in recipe.stimuli for view in recipe.views or (None,))
