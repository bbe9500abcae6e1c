"""What is wrong with a robot that is set up: its machine, and the daemon that runs on it.

`rounds` asks every check, causes first. `machine` looks at the kernel's files and the network,
`daemon` at two answers of the status socket, some seconds apart. One file is one check, and each
says what is wrong, since when if that is known, and what to do.
"""
