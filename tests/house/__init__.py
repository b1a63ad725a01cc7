"""The size and shape of the house, measured from its sources."""
