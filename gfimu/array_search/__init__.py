"""Search of accelerometer arrays for a volume, a number of chips and an objective.

`search.optimize` is the way in. From the lowest floor up: `shapes`, `problem` (what may be built), `criteria` and
`objectives` (what is to be small), `exchange` and `polish` (how it is made small), `certificate` (how small it can be
at all), `search`, `front` (two objectives), `pictures`; `brief` is the file in which a designer writes all of it.
"""
