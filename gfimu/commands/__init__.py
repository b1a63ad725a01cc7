"""The commands: a function under each, with its options, its result and its words on the shell.

In: paths or objects.
Out: the result object, files where an ``out`` is named. The one room of gfimu that knows the world and the wire.
"""
