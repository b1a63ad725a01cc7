"""The firmware of the LPC1768.

In: C sources (``src``).
Out: images (``image``) and how they are built.
"""
