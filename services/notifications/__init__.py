"""Notifications that work has ended, by a webhook or a command of the service's owner.

`outbox` finds what has ended in the events and keeps what is left to send, with its words; `delivery` sends it in the
background of the API. A message is delivered at least once, and has an id.
"""
