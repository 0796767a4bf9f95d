"""`python -m cyclopean`: the command line, where no `cyclopean` is on the path."""

from runner.cli.main import main

if __name__ == "__main__":
    main()
