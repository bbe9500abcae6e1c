"""Checks of the running daemon, each a function of a `Patient`; nothing here touches anything."""
