"""Angular rate from an accelerometer array: integration of the angular acceleration."""
