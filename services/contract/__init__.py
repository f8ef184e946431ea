"""The contract of plug-ins: what each kind must do, checked on a plug-in by `gaplab plugin check` and by the tests.

A check is a function of a plug-in class, whose type says of which kinds, and whose docstring says what the plug-in
does. It raises AssertionError with the reason if the plug-in does not.
"""
