"""Log formats: one reader a file, each from a file to the columns it holds."""
