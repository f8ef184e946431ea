"""Every query, by subject; each function works in the session that it is given and commits nothing.

Experiments and studies are inserted, found and listed in `experiments`, and moved by people in `verbs`. `leases` says
who may go on with a repetition, `turns` whose turn it is, `giving_way` who had better stop, `attempts` who had it;
`settling` keeps an experiment in line with its repetitions, `steps` appends to their logs, and `checkpoints` keeps what
there is of the next step. What is shown comes from `reads`, `progress` and `results`.
"""
