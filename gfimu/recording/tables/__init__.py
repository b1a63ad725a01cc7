"""Tables of named columns: CSV and Parquet files, and tables of pandas, polars and Arrow."""
