"""The open benchmark of naming what a simulation gets wrong: worlds, truth kept apart, judge, baselines, table."""
