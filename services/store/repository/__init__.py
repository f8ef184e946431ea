"""Every query, by subject; each function works in the session that it is given and commits nothing.

Experiments and studies are inserted, found, listed and cancelled in `experiments`; `leases` says who may go on with a
repetition; `steps` appends to its log, and `checkpoints` keeps what there is of its next step; what is shown comes from
`reads`, `progress` and `results`.
"""
