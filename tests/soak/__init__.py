"""The soak: random faults on the real service while clients use it, then a check of all that it acknowledged.

`make soak` runs it. `stage` starts the service, `faults` hurt it, `clients` use it and `history` keeps what they were
told, `witness` keeps every move of every repetition, `evidence` reads what the database has at the end, and `checker`
says what is wrong with it.
"""
