"""What the residual shows: spectra, dependences, tests of whiteness."""
