"""The result of a diagnosis: causes, residual, gain, and what is unexplained."""
