"""The paper, pure and deterministic: no input or output, no clock, no global state.

Reading order: `types`, `loop`, `tuning`, `scoring`, then any strategy.
"""
