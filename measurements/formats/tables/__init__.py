"""Tables: long and wide CSV, Parquet and MATLAB files."""
