"""Described errors: unknown functions at places of the forward model, added to what a simulation predicts."""
