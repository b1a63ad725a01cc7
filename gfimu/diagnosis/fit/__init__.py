"""Fit: linearise, integrate out the nuisance parameters, step, learn."""
