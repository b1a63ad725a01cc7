"""Design of arrays: the figures of merit of one, and the search for the best.

In: an array to score, or a brief: volume, number of chips, objective.
Out: `Score`, the best array with a bound on what any array could reach, a front of two objectives.
"""
