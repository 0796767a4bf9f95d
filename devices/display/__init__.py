"""A display as a colour device: models, display files, rigs and viewing geometry."""
