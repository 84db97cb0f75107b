"""A positioning task as tables, figures, a film and a page."""
