"""The report page: one self-contained HTML file, made of the files of a run."""
