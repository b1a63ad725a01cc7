"""`python -m gfimu`: the command line, where the script isn't on the path."""

from gfimu.cli import main

if __name__ == "__main__":
    main()
