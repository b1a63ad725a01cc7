"""A function under each command: paths or objects in, the result object out, files where an ``out`` is named.

These stand above all other packages, like `gfimu.cli`, and are reached as ``gfimu.simulate``, ``gfimu.estimate`` and
so on. They print nothing.
"""
