"""Mutated inputs over all readers: each ends in success or in one line of a typed error, in bounded memory and time."""
