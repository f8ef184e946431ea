"""Measurements of a robot on a bench: requests, takes, answers, and what follows from their corrections."""
