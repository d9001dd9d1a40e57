"""The chapters of the report page, one file each: from the files of a run to HTML."""
