"""The vocabulary on the wire: frozen data with types and bounds, and no behaviour.

Read `spec` first: it is what a user submits.
"""
