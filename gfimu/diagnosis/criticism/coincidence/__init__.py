"""Coincidences: free numbers of causes that lie on a pattern, so that one thing upstream made them all."""
