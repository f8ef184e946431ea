"""The edge: HTTP for programs, and the `gaplab` command for people. Both only insert into the database and read it.

Read `app` first, then `routes`, which know `http` alone. `process` runs the application, `clients` talk to it, and
`commands` are the command line: they know `clients` and `process` alone. tests/unit/test_architecture.py holds this.
"""
