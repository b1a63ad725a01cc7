"""Located terms: an unknown function of the motion, of time or of a reading, at a place of the forward model."""
