"""Motion as a function of time.

In: motion files, profiles of a table, poses.
Out: angle, rate and acceleration of table or body at any time.
"""
