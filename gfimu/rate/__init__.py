"""Angular rate from an accelerometer array: per sample, by a filter or a smoother, over a run or a stream.

From the lowest floor up: `sensing` (errors of the channels), `problem` and `result`, the recursions and their `kalman`
filter, one file per method, `registry` (the methods by name), `methods` (one call for all), `solve` (for an estimate);
`live` and `stream` for a stream.
"""
