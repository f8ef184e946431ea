"""Rollouts computed on request: replays and predictions."""
