"""Angular rate from an accelerometer array: per sample, filtered or smoothed, over a run or a stream.

In: readings (n, c), an array, the errors of its channels (`sensing`).
Out: `RateEstimate` with covariance; faulty channels (`health`), lower bounds (`bounds`), rotation about a known axis
(`axis`). One file per method, by name in `registry`; `methods` has one call for all.
"""
