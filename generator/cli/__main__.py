"""`python -m generator.cli` is the command `mover`."""

from generator.cli.app import main

if __name__ == "__main__":
    main()
