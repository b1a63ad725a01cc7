"""Which run of the table separates named effects best."""
