"""Physical effects: one small class each, in a registry; each knows its name, parameters, priors and place."""
