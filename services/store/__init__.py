"""The only SQL: tables, sessions, and every query. Read `models` first, then `repository`.

A service opens one `Store`; a use case runs in one of its transactions and calls the functions of `repository` in it.
"""
