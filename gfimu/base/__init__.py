"""The ground: what every room uses and that knows no physics.

In: files, tables and settings as people write them.
Out: typed one-line errors, units, checked files, results that describe themselves, optional packages, entry points.
"""
