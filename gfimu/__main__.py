"""`python -m gfimu`: the command line, where the script isn't on the path."""

from gfimu.commands.shell.program import main

if __name__ == "__main__":
    main()
