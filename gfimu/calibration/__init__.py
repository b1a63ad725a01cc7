"""Calibration: one error model, one result class, one method per file.

`methods` has one call for every name of `registry`. All return a `result.Calibration`, whose triads are those of
`error_model`.
"""
