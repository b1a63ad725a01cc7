"""What the bytes on the wire mean.

In: bytes, a format described in a file.
Out: samples, commands, checksums, counts of what was lost.
"""
