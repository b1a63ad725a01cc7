"""Diagnosis of a body moved by hand: its rate from gyros, its specific force unknown at every sample."""
