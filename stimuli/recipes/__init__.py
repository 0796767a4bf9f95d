"""Recipes: YAML files that say which pictures there are and how they are made."""
