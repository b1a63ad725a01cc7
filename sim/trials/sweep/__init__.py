"""Campaigns: many cases of a plan, drawn by a design, run in batches by an executor, kept as one Parquet dataset."""
