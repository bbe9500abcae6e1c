"""The machine under the daemon: is everything there that a configuration asks for?

`refusals` is what the daemon will not start with, and `run` itself asks it; `examination` adds what
the daemon would wait for. Each check is a function that returns findings: a cause, a remedy, and
how much it matters. Causes stand before their consequences.
"""
