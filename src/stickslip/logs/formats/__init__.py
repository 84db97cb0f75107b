"""Log formats: readers, each from a file to the columns it holds."""
