"""Which sparkles a picture holds: where, how many, how large, how bright, and for which eyes."""
