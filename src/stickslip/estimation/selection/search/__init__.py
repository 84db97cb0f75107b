"""Forward search for the terms that a log supports, and the windows that it takes."""
