"""What observers look at: pictures for two eyes in absolute XYZ, and the recipes that make them."""
