"""The data of the API: frozen values with types and bounds, without behaviour.

Read `spec` first: it is what users submit.
"""
