"""The only place with sockets, files, serial lines, buses and clocks."""
