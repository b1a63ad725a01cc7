"""Views of the residuals of a verdict: spectra, dependences, whiteness."""
