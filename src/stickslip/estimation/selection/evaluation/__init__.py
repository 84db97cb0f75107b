"""Evaluation of a selected model: its law, the effort it predicts, and the rows of its figures."""
