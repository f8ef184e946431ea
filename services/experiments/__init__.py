"""Experiments and studies, as people submit, list, edit and control them."""
