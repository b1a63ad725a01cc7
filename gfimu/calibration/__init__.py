"""Calibration: one error model, one result class, one method per file.

In: recordings of poses, a rate table, a spin or any motion; an earlier calibration to update.
Out: `Calibration` with its covariance, a certificate with its uncertainty budget (`certificate`), files of other
programs (`exporting`). `registry` lists the methods; `method` says what one is, and has one call for all.
"""
