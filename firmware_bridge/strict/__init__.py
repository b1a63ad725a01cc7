"""A strict board: rules that a real LPC1768 imposes on an image.

In: an image.
Out: findings, each with the rule, the place in the program and its section of the manual.
"""
