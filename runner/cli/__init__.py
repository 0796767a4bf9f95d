"""The command line: each command a few lines that call a function, imported only when it is called."""
