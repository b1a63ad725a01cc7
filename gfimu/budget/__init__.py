"""Error budgets: what errors of parts, places and angles become in the result.

In: an array, standard deviations of its errors, a motion.
Out: drift of the position with time (`drift`), shares of each tolerance in the error of a motion (`tolerances`).
"""
