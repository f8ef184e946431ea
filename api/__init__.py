"""The edge: HTTP for programs, and the `gaplab` command for people. Both only insert into the database and read it.

Read `app` first, then `routes`; `cli` is the command, and talks to a running service through `client`.
"""
