"""Replays and predictions: rollouts that are computed on request."""
