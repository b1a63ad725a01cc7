"""Files: whole or not at all; schemas, models, rerun streams, checks of outputs before long work."""
