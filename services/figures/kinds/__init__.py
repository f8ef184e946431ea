"""The kinds of figures, one module for each."""
