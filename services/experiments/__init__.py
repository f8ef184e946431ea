"""Experiments and studies: submission, lists, edits and control by people."""
