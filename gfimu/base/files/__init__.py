"""Files: whole or not at all; columns, tables, models, rerun streams, checks of outputs before long work."""
