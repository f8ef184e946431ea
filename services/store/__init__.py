"""The database: tables, transactions, and the loads and saves that several folders share. Read `models` first.

A process opens one `Store`. A use case runs in one of its transactions; `session.transaction` makes it one.
"""
