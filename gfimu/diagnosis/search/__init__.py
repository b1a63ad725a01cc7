"""Search: the most probable set of causes, under the most probable model of the nuisance parameters."""
