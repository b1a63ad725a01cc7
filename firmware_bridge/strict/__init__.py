"""A strict board: rules that name what a real LPC1768 would not forgive, with the place in the program."""
