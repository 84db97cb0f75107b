"""Commands that make the figures and the tables of the documentation, one a module."""
