"""The computer at the other end.

In: a port or another source.
Out: a recording on the host's clock, an estimate while it streams, the chips' self-test.
"""
