"""Selection of the model that a log supports, and its fit over windows of slip."""
