"""Controllers of a scenario: one table a family of methods, in one registry."""
