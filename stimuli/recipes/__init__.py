"""Recipes: YAML files that list pictures and how they are made."""
