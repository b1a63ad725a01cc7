"""The firmware of the LPC1768: C sources (``src``), the built images (``image``) and how they are built."""
