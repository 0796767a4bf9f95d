"""The bootstrap over observers: scores and classes that other observers of the same kind would have given."""
