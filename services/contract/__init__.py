"""The contract of plug-ins: what each kind must do, checked on a plug-in by `gaplab plugin check` and by the tests.

Each module has the checks of one kind. A check is a function of a plug-in class whose docstring says what the plug-in
does; it raises AssertionError with the reason if the plug-in does not.
"""
