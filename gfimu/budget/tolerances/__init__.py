"""What machining and chip tolerances of an array do to α, ω and position, cause by cause, to first order."""
