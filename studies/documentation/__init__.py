"""What makes the figures and the tables of the documentation; each module is one command."""
