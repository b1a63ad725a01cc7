"""Motion of a table: as other motions make it, and the angle at which it began."""
