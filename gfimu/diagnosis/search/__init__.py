"""The search for the most probable set of causes, under each model of the nuisance parameters."""
