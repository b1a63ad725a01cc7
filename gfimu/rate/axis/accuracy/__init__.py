"""How well a rotation about a known axis can be known: bounds, predictions of an estimate, drift, noise as a rate."""
